"""NGSolve: the Hellan-Herrmann-Johnson method for nonlinear Koiter shells (Neunteufel & Schoeberl 2024), membrane strain in Regge elements, moments condensed.

ngsolve_shell.py CASE N ngs_ORDER[t] CPU_LIMIT [STEPS]: displacements of this order on quadrilaterals (t: triangles). Cook's membrane: plane elasticity of this order.
Averaged normals move on after each load step, as the authors do it; a step begins with all of the load where Newton gets through.
"""
import sys
import time

import netgen.meshing as meshing
import numpy as np
from cases import Grid
from ngsolve import (BilinearForm, CF, Cof, Cross, FacetSurface, GridFunction, Grad, H1, HCurlCurl, HDivDivSurface, Id, InnerProduct, Interpolate,
                     LinearForm, Mesh, NormalFacetSurface, Normalize, OuterProduct, Parameter, Trace, Variation, VectorFacetSurface, VectorH1, Norm, acos, ds, dx,
                     specialcf, Sym)
from outcome import Stepper, report
import ngsolve

imported = time.process_time()
name, n, peer, limit = sys.argv[1], int(sys.argv[2]), sys.argv[3], float(sys.argv[4])
order, triangles = int(peer[4]), peer.endswith("t")
grid = Grid(name, n)
p = grid.problem
steps = int(sys.argv[5]) if len(sys.argv) > 5 else p.steps


def plane():
    """Cook's membrane in the plane, conforming elements of this order, inner ones condensed."""
    from netgen.geom2d import SplineGeometry
    geometry = SplineGeometry()
    corners = [geometry.AddPoint(*q) for q in ((0, 0), (48, 44), (48, 60), (0, 44))]
    for k, edge in enumerate(("bottom", "right", "top", "left")):
        geometry.Append(["line", corners[k], corners[(k + 1) % 4]], bc=edge)
    mesh = Mesh(geometry.GenerateMesh(maxh=48 / n))
    space = VectorH1(mesh, order=order, dirichlet="left")
    u, v = space.TnT()
    strain, test = Sym(Grad(u)), Sym(Grad(v))
    a = BilinearForm(space, symmetric=True, condense=True)
    a += p.e / (1 - p.nu ** 2) * ((1 - p.nu) * InnerProduct(strain, test) + p.nu * Trace(strain) * Trace(test)) * dx
    f = LinearForm(space)
    f += p.line[2] * v[1] * ds("right")
    a.Assemble()
    f.Assemble()
    found = GridFunction(space)
    inverse = a.mat.Inverse(space.FreeDofs(True), inverse="sparsecholesky")
    f.vec.data += a.harmonic_extension_trans * f.vec
    found.vec.data = inverse * f.vec
    found.vec.data += a.harmonic_extension * found.vec
    found.vec.data += a.inner_solve * f.vec
    stepper = Stepper(1, limit, imported)
    stepper.level, stepper.steps, stepper.iterations = 1.0, 1, 1
    report(grid, [found(mesh(48, 52))[1]], stepper, space.ndof)


if name == "cook":
    plane()
    sys.exit()

surface = meshing.SurfaceGeometry(lambda x, y, z: p.map(x, y))
mesh = Mesh(surface.GenerateMesh(quads=not triangles, nx=grid.nx, ny=grid.ny))
mesh.Curve(order)
edges = {kind: "|".join(e for e, k in p.edges.items() if k in kinds) or "none"
         for kind, kinds in {"clamped": ("clamped",), "symmetry": ("symmetry_x", "symmetry_y", "symmetry_z", "supported_x"),
                             "x": ("clamped", "symmetry_x", "supported_x", "hinged", "diaphragm"), "y": ("clamped", "symmetry_y", "hinged"),
                             "z": ("clamped", "symmetry_z", "supported_x", "hinged", "diaphragm")}.items()}
displacements = VectorH1(mesh, order=order, dirichletx_bbnd=edges["x"], dirichlety_bbnd=edges["y"], dirichletz_bbnd=edges["z"])
moments = HDivDivSurface(mesh, order=order - 1, discontinuous=True)
hybrid = NormalFacetSurface(mesh, order=order - 1, dirichlet_bbnd=edges["clamped"] + "|" + edges["symmetry"])
space = displacements * moments * hybrid
u, m, hyb = space.TrialFunction()
m, hyb = m.Trace(), hyb.Trace()
regge = HCurlCurl(mesh, order=order - 1, discontinuous=True)
state = GridFunction(space)

nv, tv = specialcf.normal(3), specialcf.tangential(3)
cnv = Cross(nv, tv)
ptau = Id(3) - OuterProduct(nv, nv)
ftau = Grad(u).Trace() + ptau
etau = 0.5 * (ftau.trans * ftau - ptau)
if p.linear:
    etau = 0.5 * (ptau * Grad(u).Trace() + Grad(u).Trace().trans * ptau)
jac = Norm(Cof(ftau) * nv)
nv_def, tv_def = Normalize(Cof(ftau) * nv), Normalize(ftau * tv)
cnv_def = Cross(nv_def, tv_def)
hesse = (u.Operator("hesseboundary").trans * nv_def).Reshape((3, 3))

on_clamped, on_symmetry = (GridFunction(FacetSurface(mesh, order=0)) for _ in range(2))
on_clamped.Set(1, definedon=mesh.BBoundaries(edges["clamped"]))
on_symmetry.Set(1, definedon=mesh.BBoundaries(edges["symmetry"]))
now = Normalize(Cof(ptau + Grad(state.components[0])) * nv)
facets = VectorFacetSurface(mesh, order=order - 1)
averaged, averaged_0 = GridFunction(facets), GridFunction(facets)
averaged.Set(nv, dual=True, definedon=mesh.Boundaries(".*"))
averaged_0.Set(nv, dual=True, definedon=mesh.Boundaries(".*"))
projected = Normalize(averaged - (tv_def * averaged) * tv_def)


def norm(a):
    return p.e / (1 - p.nu ** 2) * ((1 - p.nu) * InnerProduct(a, a) + p.nu * Trace(a) ** 2)


def inverse_norm(a):
    return (1 + p.nu) / p.e * (InnerProduct(a, a) - p.nu / (p.nu + 1) * Trace(a) ** 2)


form = BilinearForm(space, symmetric=True, condense=True)
form += Variation(0.5 * p.h * norm(Interpolate(etau, regge)) * ds).Compile()
form += Variation((-6 / p.h ** 3 * inverse_norm(m) + InnerProduct(hesse + (jac - nv * nv_def) * Grad(nv), 1 / jac * m)) * ds).Compile()
form += Variation((acos(cnv_def * projected) - acos(cnv * Normalize(averaged_0)) + hyb * cnv) * m[cnv, cnv] * ds(element_boundary=True)).Compile()
# Loads: a vector, as they are dead.
w = displacements.TestFunction()
load = LinearForm(displacements)
if p.line:
    edge, dof, q = p.line
    load += CF(tuple(q if k == dof else 0 for k in range(3))) * w * dx(definedon=mesh.BBoundaries(edge))
if p.area:
    dof, q = p.area
    load += q * w.Trace()[dof] * ds
load.Assemble()
numbers = space.Range(0)
force = state.vec.CreateVector()
force[:] = 0
force[numbers] = load.vec


def vertex_dof(place, dof):
    """Number of the freedom at a corner of the grid: hat functions are one there and all others vanish."""
    target = np.array(p.map(*place), dtype=float)
    k = min(range(mesh.nv), key=lambda v: np.linalg.norm(np.array(mesh.vertices[v].point) - target))
    return numbers.start + dof * (displacements.ndof // 3) + displacements.components[dof].GetDofNrs(ngsolve.NodeId(ngsolve.VERTEX, k))[0]


for place, dof, value in p.force:
    force[vertex_dof(place, dof)] += value
free = space.FreeDofs(True)
for place, dof in p.fixed:
    free.Clear(vertex_dof(place, dof))
driven = vertex_dof(p.control[0], p.control[1]) if p.control else None
factor = 0.0


def values():
    if p.control:
        return [factor]
    return [factor_ * state.vec[vertex_dof(place, dof)] for _, place, dof, factor_ in p.monitors]


def solve(inverse, r):
    r.data += form.harmonic_extension_trans * r
    d = r.CreateVector()
    d.data = inverse * r
    d.data += form.harmonic_extension * d
    d.data += form.inner_solve * r
    return d


def attempt(level):
    global factor
    before, factor_before = state.vec.CreateVector(), factor
    before.data = state.vec
    averaged.Set((1 - on_clamped - on_symmetry) * now + on_symmetry * (now - (now * cnv) * cnv) + on_clamped * nv, dual=True, definedon=mesh.Boundaries(".*"))
    r, g = state.vec.CreateVector(), state.vec.CreateVector()
    first = None
    if not p.control:
        factor = level
    for iteration in range(1, 2 if p.linear else 26):
        form.Apply(state.vec, r)
        r.data -= factor * force
        form.AssembleLinearization(state.vec)
        inverse = form.mat.Inverse(free, inverse="sparsecholesky")
        g.data = r
        d = solve(inverse, g)
        if p.control:
            place, dof, end = p.control
            g.data = force
            e = solve(inverse, g)
            change = (level * end - state.vec[driven] + d[driven]) / e[driven]
            factor += change
            d.data -= change * e
        size = abs(InnerProduct(d, r)) ** 0.5
        state.vec.data -= d
        if not np.isfinite(size):
            break
        first = first or size
        if p.linear or size <= 1e-6 * first or size < 1e-9:
            return True, iteration
    state.vec.data, factor = before, factor_before
    return False, iteration


stepper = Stepper(1 if p.linear else steps, limit, imported)
stepper.run(attempt)
report(grid, values(), stepper, space.ndof)
