#!/usr/bin/env python3
"""Malformed input of every reader: exit code 2 and one sentence that names file and line where there are lines; no hang, no crash, no
NaN, and nothing written.

One case a line: what is changed in a good input, and words of the answer.
"""
import fcntl
import os
import re
import struct
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
GOOD = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 2 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 density = 1.0 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 0.0, 0.0, 1.0 total = .true. /
&step load_factor = 1.0 /
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
"""
MESH, MATERIAL, SECTION, SUPPORT, LOAD, STEP, MONITOR = GOOD.splitlines()
TIME = STEP.replace("load_factor = 1.0", "control = 'dynamic' duration = 1.0")

# (text that is replaced, its replacement, line of the answer, words of it); lines of the whole input
NAMELISTS = [
    (GOOD, "", 0, "the group &mesh is missing"),
    (GOOD, "mesh\n", 1, "found 'mesh' outside of a group"),
    (GOOD, "& mesh /\n", 1, "does not begin a group"),
    (GOOD, "&end\n", 1, "&end closes no group"),
    (GOOD, "&mesh\n\0/\n", 2, "this is not a text file: it contains the byte 0"),
    (MONITOR, MONITOR[:-1], 7, "is not closed: a group ends with /, found the end of the file"),
    (STEP, STEP[:-1], 6, "is not closed: a group ends with /, found &monitor in line 7"),
    ("generator =", "generator", 1, "found 'generator' where a key and = are expected"),
    ("mu = 1.0e6", "mu(1) = 1.0e6", 2, "is no name of a key (an index or component is not allowed)"),
    ("mu = 1.0e6", "mu = 1 mu = 2", 2, "the key mu is given twice, first in line 2"),
    ("mu = 1.0e6", "mu = ", 2, "a value is missing after ="),
    ("10.0, 1.0", "10.0,, 1.0", 1, "a value is missing before the comma"),
    ("10.0, 1.0", "0*1.0", 1, "the repeat count of '0*1.0' must lie between 1 and 100000"),
    ("10.0, 1.0", "2* ", 1, "found ' ' where a value is expected"),
    ("10.0, 1.0", "99999*1.0, 99999*1.0", 1, "more than 100000 values"),
    ("'rubber' law", "'rubber law", 2, "is not closed in its line"),
    ("load_factor = 1.0", "load_factor = one", 6, "&step load_factor = one: expected a number"),
    ("load_factor = 1.0", "load_factor = NaN", 6, "&step load_factor = NaN: expected a number"),
    ("load_factor = 1.0", "load_factor = 1e999", 6, "expected a number"),
    ("load_factor = 1.0", "load_factor = '1.0'", 6, "expected a number"),
    ("load_factor = 1.0", "maximum_increments = 1.5", 6, "expected an integer"),
    ("load_factor = 1.0", "maximum_increments = 99999999999", 6, "expected an integer"),
    ("load_factor = 1.0", "maximum_increments = 0", 6, "expected an integer of at least 1"),
    ("total = .true.", "total = yes", 5, "expected .true. or .false."),
    ("total = .true.", "total = 'true'", 5, "expected .true. or .false. (without quotes)"),
    ("type = 'clamped'", "type = clamped", 4, "expected a string in quotes"),
    ("type = 'clamped'", "type = 'clampd'", 4, "expected one of: "),
    ("vector = 0.0, 0.0, 1.0", "vector = 0.0, 1.0", 5, "3 values are expected, found 2"),
    ("thickness = 0.1", "thickness = 0.1, -0.2", 3, "&section thickness = -0.2: expected a number greater than 0"),
    ("name = 'rubber'", "name = 'a', 'b'", 2, "one value is expected, found 2"),
    ("name = 'tip'", "name = 'a,b'", 7, "is no name; a name is made of letters, digits, _ - and ."),
    ("&step", "&steps", 6, "unknown group &steps, did you mean 'step'?"),
    (MESH, MESH + "\n" + MESH, 2, "there can be only one such group, and there is one in line 1"),
    (MATERIAL, MATERIAL + "\n" + MATERIAL, 3, "there is a material 'rubber' in line 2 already"),
    (MESH, "&mesh /", 1, "either file or generator is expected; generators: "),
    ("generator = 'rectangle'", "generator = 'rectangel'", 1, "did you mean 'rectangle'?"),
    ("divisions = 4, 2", "divisions = 100000, 100000", 1, "GB of memory"),
    ("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 2", "generator = 'quadrilateral' corners = 0,0,0, 1,0,0, 0,1,0, 1,1,0 divisions = 4, 2", 1,
     "corners: the quadrilateral must be convex, its four corners in cyclic order"),
    ("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 2", "generator = 'disk' radius = 1.0 rings = 30000", 1, "GB of memory"),
    ("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 2",
     "generator = 'cylinder' radius = 1.0 length = 1.0 angles = 90.0, 0.0 divisions = 4, 4", 1, "must ascend and span at most 360 degrees"),
    ("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 2",
     "generator = 'annulus' radii = 1.0, 2.0 angles = 0.0, 400.0 divisions = 4, 4", 1, "must ascend and span at most 360 degrees"),
    ("divisions = 4, 2", "divisions = 4, 2 refine = 30", 1, "expected an integer of at most 8"),
    ("law = 'neo_hookean'", "law = 'gent'", 2, "; the law takes "),
    ("density = 1.0", "density = -1.0", 2, "expected a number of at least 0"),
    ("divisions = 4, 2", "divisions = 4, 2 normals = 'exact'", 1, "needs a generator that knows its curved surface: cylinder, cone, "),
    ("divisions = 4, 2", "divisions = 4, 2 crease = 'none'", 1, "the mesh has no edge set 'none'"),
    ("mu = 1.0e6", "mu = 1.0e6 jm = 2", 2, "jm"),
    ("thickness = 0.1", "thickness = 0.1 slack = 0.1", 3, "only a section of type 'membrane' has it"),
    ("thickness = 0.1", "thickness = 0.1 type = 'membrane' thickness_points = 3", 3, "a section of type 'membrane' has none: it does not bend"),
    (SECTION, SECTION + "\n" + SECTION, 4, "' has a section already (the section number 1 of this file)"),
    (SECTION, SECTION.replace("/", "element_set = 'none' /"), 3, "none"),
    ("type = 'clamped'", "fixed = 'ux', 'uy', 'uz' ux = 1.0", 4, "the component is held twice: it has a value and is in fixed"),
    ("type = 'clamped'", "fixed = 'ux' axes = 'given' axis_1 = 1,0,0 axis_2 = 2,0,0", 4, "it must not be parallel to axis_1"),
    ("type = 'clamped'", "fixed = 'ux' axes = 'cylindrical' axis = 0,0,0 origin = 0,0,0", 4, "the vector (0, 0, 0) is no direction"),
    ("node_set = 'edge_x0'", "node_set = 'edge_x9'", 4, "edge_x0"),
    ("type = 'force' node_set = 'edge_x1'", "type = 'line' edge_set = 'rim'", 5, "edge_x0"),
    (LOAD, "&load type = 'foundation' normal = -1.0 /", 5, "the stiffness of a foundation is not negative"),
    (LOAD, "&load type = 'gravity' vector = 0, 0, 1 /\n&load type = 'pressure' pressure = x /", 6, "expected a number"),
    ("load_factor = 1.0", "first_increment = 0.5 largest_increment = 0.1", 6, "it is larger than largest_increment"),
    (STEP, TIME.replace("/", "first_increment = 0.5 largest_increment = 0.1 /"), 6, "it is larger than largest_increment"),
    (STEP, TIME.replace("/", "first_increment = -0.5 /"), 6, "time goes one way"),
    (STEP, TIME.replace("/", "times = 0.5, 0.2 factors = 1, 2 /"), 6, "times have to rise"),
    (STEP, TIME.replace("/", "output_times = 0.5, 0.2 /"), 6, "times have to rise"),
    (STEP, TIME.replace("/", "output_times = 0.5, 2.0 /"), 6, "the last is after the end of the step"),
    (STEP, TIME.replace("/", "smooth = .true. /"), 6, "it is between times, and none are given"),
    (MONITOR, MONITOR + "\n" + TIME + "\n&initial_velocity velocity = 0, 0, 0 /", 9, "velocity and spin are zero; expected is one of them, or both"),
    ("load_factor = 1.0", "control = 'displacement' displacements = 1.0", 6, "the key component is required"),
    ("load_factor = 1.0", "control = 'arc_length' node_set = 'edge_x1' component = 'z' displacements = 1.0, 1.0", 6, "stands there twice in a row; once is enough"),
    (MONITOR, MONITOR + "\n&accuracy monitor = 'nothing' target = 0.1 /", 8, "tip"),
    (MONITOR, MONITOR.replace("/", "reduce = 'max' /") + "\n&accuracy monitor = 'tip' target = 0.1 /", 8, "which is not the mean of a displacement"),
    (MONITOR, MONITOR + "\n" + MONITOR, 8, "tip"),
    (MONITOR, MONITOR.replace("displacement", "displacment"), 7, "did you mean 'displacement'?"),
    (MONITOR, MONITOR.replace("'z'", "'w'"), 7, "x, y, z"),
    (MONITOR, MONITOR + "\n&output restart = 'never' /", 8, "expected one of: "),
    (MONITOR, MONITOR + "\n&job threads = 2000 /", 8, "expected an integer of at most 1024"),
    (MONITOR, MONITOR + "\n&job name = '../x' /", 8, "is no name"),
    (MONITOR, MONITOR + "\n&node_set name = 's' x = 1, 2, 3 /", 8, "one value or a range of two is expected"),
    (MONITOR, MONITOR + "\n&node_set name = 'all' point = 0, 0, 0 /", 8, "all"),
    (MONITOR, MONITOR + "\n&node_set name = 's' nodes = 1, 99 /", 8, "99"),
    (MONITOR, MONITOR + "\n&node_set name = 's' /", 8, "the set 's' is empty"),
    (MONITOR, MONITOR + "\n&element_set name = 's' elements = 0 /", 8, "expected an integer of at least 1"),
    ("thickness = 0.1", "thickness = 0.1 direction = 1,0,0 direction_field = 'central'", 3,
     "either a field or direction or direction_file is expected"),
    ("density = 1.0 /\n" + SECTION, "/\n" + SECTION + "\n&load type = 'gravity' vector = 0, 0, 1 /", 4,
     "gravity acts on element 1, whose material has no density"),
    ("divisions = 4, 2", "divisions = 5, 2 refine = -1", 1, "a mesh coarser by 1 levels needs multiples of 2, found "),
    ("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 2", "generator = 'hole' lengths = 10.0, 10.0 radius = 1.0 divisions = 3, 2",
     1, "must be even: half of the cells go to either outer side"),
    (SUPPORT, "&support node_set = 'edge_x0' fixed = 'ux' axes = 'given' axis_1 = 1,1,0 axis_2 = -1,1,0 /\n"
     "&support node_set = 'edge_x0' fixed = 'rx' axes = 'given' axis_1 = 1,2,1 axis_2 = -2,1,0 /", 0, "the axes of its supports contradict each other"),
    ("thickness = 0.1", "thickness = 0.1 direction = 1,0,0 direction_file = 'd.txt'", 3, "either direction or direction_file is expected"),
    (LOAD, "&load type = 'foundation' node_set = 'hub' vector = 1, 1, 1 /\n&node name = 'hub' position = 0, 0, 1 /", 5, "which belongs to no element"),
    (MONITOR, MONITOR + "\n&amplitude name = 'a' points = 0, 0, 1, 1 /\n&amplitude name = 'a' points = 0, 0, 1, 1 /", 9,
     "there is an amplitude 'a' in line 8 already"),
    (LOAD, LOAD.replace("/", "constant = .true. amplitude = 'a' /\n&amplitude name = 'a' points = 0, 0, 1, 1 /"), 5, "what is constant has no amplitude"),
    (MONITOR, MONITOR + "\n&node name = 'edge_x1' position = 0, 0, 0 /", 8, "the mesh has a node set 'edge_x1' already; take another name"),
    ("thickness = 0.1 /\n" + SUPPORT + "\n" + LOAD, "thickness = 0.1 type = 'membrane' /\n" + SUPPORT
     + "\n&load type = 'line_moment' edge_set = 'edge_x1' about_edge = 1.0 /", 0, "has edges of membranes, which bear no moments"),
    (STEP, "&equation node_set = 'centre', 'corner_x1_y0' components = 'ux', 'ux' coefficients = 1, -1 /\n"
     "&support node_set = 'centre' ux = 1.0 /\n&support node_set = 'corner_x1_y0' ux = 2.0 /\n" + STEP, 6, "it contradicts the supports: all that it leaves free is "),
    (STEP, "&imperfection step = 1 amplitudes = 1.0 /\n&accuracy target = 0.1 /\n&step control = 'buckling' /\n" + STEP, 6,
     "with &accuracy the mesh changes, an imperfection would not; refine the mesh by itself"),
    (STEP, "&imperfection step = 1 amplitudes = 1.0 /\n&imperfection step = 2 amplitudes = 1.0 /\n" + 2*"&step control = 'buckling' /\n" + STEP, 7,
     "all modes of imperfections are those of one step"),
    (STEP, "&imperfection step = 1 modes = 1, 2 amplitudes = 1.0 /\n&step control = 'buckling' /\n" + STEP, 6, " were found, expected is one for each of "),
    (SECTION, SECTION.replace("/", "element_set = 'a' /") + "\n&element_set name = 'a' elements = 1, 2 /\n"
     "&element_set name = 'b' elements = 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16 /\n"
     "&section material = 'rubber' thickness = 0.2 element_set = 'b' /\n"
     "&imperfection step = 1 amplitudes = 1.0 times_thickness = .true. /\n&step control = 'buckling' /", 7, "sections have thicknesses from "),
]

HEAD22 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
NODES22 = "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n"
ELEMENTS22 = "$Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 1 3 4\n$EndElements\n"
GMSH22 = HEAD22 + NODES22 + ELEMENTS22
GMSH41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
2 1 "sheet"
$EndPhysicalNames
$Entities
0 0 1 0
1 0 0 0 1 1 0 1 1 0
$EndEntities
$Nodes
1 4 1 4
2 1 0 4
1
2
3
4
0 0 0
1 0 0
1 1 0
0 1 0
$EndNodes
$Elements
1 2 1 2
2 1 2 2
1 1 2 3
2 1 3 4
$EndElements
"""
BINARY = b"$MeshFormat\n4.1 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n"
# file, content, line (0: none), words
MESHES = [
    ("m.msh", "", 1, "this is no Gmsh mesh: it does not begin with $MeshFormat"),
    ("m.msh", "$Foo\n$EndFoo\n", 1, "this is no Gmsh mesh"),
    ("m.msh", GMSH22.replace("2.2 0 8", "3.0 0 8"), 2, "3.0"),
    ("m.msh", GMSH22.replace("2.2 0 8", "2.2 0"), 3, "found '$EndMeshFormat' where an integer is expected"),
    ("m.msh", GMSH22.replace("2.2 0 8", "2.2 0 4"), 2, "the size of an integer is 4 bytes, 8 is expected"),
    ("m.msh", GMSH22.replace("$Nodes\n4", "$Nodes\n5"), 10, "where an integer is expected: the section holds less than it announces"),
    ("m.msh", GMSH22.replace("$Nodes\n4", "$Nodes\n3"), 9, "found '4 0 1 0' where $EndNodes is expected: the section $Nodes holds more than it announces"),
    ("m.msh", GMSH22.replace("$Nodes\n4", "$Nodes\n99999999999"), 5, "a count is impossible: the file does not hold that much"),
    ("m.msh", GMSH22.replace("$Nodes\n4", "$Nodes\n99999999999999999999999"), 5, "where an integer is expected"),
    ("m.msh", GMSH22.replace("$Nodes\n4", "$Nodes\n-4"), 5, "a count is impossible"),
    ("m.msh", GMSH22.replace("1 0 0 0\n", "1 0 zero 0\n"), 6, "found 'zero' where a number is expected"),
    ("m.msh", GMSH22.replace("1 0 0 0\n", "1 0 nan 0\n"), 6, "found 'nan' where a number is expected"),
    ("m.msh", GMSH22.replace("1 0 0 0\n", "0 0 0 0\n"), 6, "the number of a node is above 0, found 0"),
    ("m.msh", GMSH22.replace("2 1 0 0\n", "1 1 0 0\n"), 7, "there is a second node with the same tag; the first is in line 6"),
    ("m.msh", GMSH22.replace("1 2 2 1 1 1 2 3", "1 2 2 1 1 1 2 9"), 13, "9"),
    ("m.msh", GMSH22.replace("1 2 2 1 1 1 2 3", "0 2 2 1 1 1 2 3"), 13, "the number of an element is above 0, found 0"),
    ("m.msh", GMSH22.replace("1 2 2 1 1 1 2 3", "1 2 -2 1 1 1 2 3"), 13, "an element has -2"),
    ("m.msh", GMSH22.replace("1 2 2 1 1 1 2 3", "1 777 2 1 1 1 2 3"), 13, "777"),
    ("m.msh", GMSH22.replace("$EndElements\n", ""), 15, "the section $Elements is not closed by $EndElements"),
    ("m.msh", GMSH22.replace("$EndNodes", "$EndNode"), 10, "found '$EndNode' where $EndNodes is expected"),
    ("m.msh", HEAD22 + NODES22, 0, "the file has no triangles; mesh the surfaces (gmsh -2)"),
    ("m.msh", GMSH22 + "text\n", 16, "found 'text' where a section ($...) is expected"),
    ("m.msh", GMSH22.replace("1 1 1 2 3", "1 1 1 1 3"), 0, "is degenerate: its nodes coincide or lie on a line"),
    ("m.msh", GMSH41.replace("1 4 1 4", "1 4 1"), 14, "a block of nodes begins with a dimension from 0 to 3"),
    ("m.msh", GMSH41.replace("2 1 0 4", "7 1 0 4"), 14, "a block of nodes begins with a dimension from 0 to 3, an entity, and 0 or 1 for parametric"),
    ("m.msh", GMSH41.replace("2 1 0 4", "2 1 5 4"), 14, "a block of nodes begins with a dimension"),
    ("m.msh", GMSH41.replace("1 4 1 4", "1 9 1 9"), 22, "there are 4 nodes, but $Nodes announces 9"),
    ("m.msh", GMSH41.replace("1 2 1 2\n2 1 2 2", "1 3 1 3\n2 1 2 3"), 29, "found '$EndElements' where an integer is expected"),
    ("m.msh", GMSH41.replace('2 1 "sheet"', '2 1 "all"'), 6, "a physical group is named 'all'; that name is kept for the whole mesh"),
    ("m.msh", GMSH41.replace('2 1 "sheet"', '7 1 "sheet"'), 6, "a physical group has a dimension from 0 to 3 and a tag above 0, found"),
    ("m.msh", GMSH41.replace('2 1 "sheet"', '2 1 sheet'), 6, "the name of a physical group is missing"),
    ("m.msh", GMSH41.replace("1 0 0 0 1 1 0 1 1 0", "1 0 0 0 1 1 0 1 0 0"), 10, "a physical group with the tag 0"),
    ("m.msh", GMSH41.replace("1 0 0 0 1 1 0 1 1 0", "1 0 0 0 1 1 0 2 1 -2 0"), 10, "enters its physical groups with both signs"),
    ("m.msh", GMSH41.replace("1 0 0 0 1 1 0 1 1 0", "1 0 0 0 1 1 0 2 1 -1 0"), 10, "the physical group 1 is named twice for one entity"),
    ("m.msh", GMSH22.replace("1 2 2 1 1 1 2 3", "1 2 99999999999 1 1 1 2 3"), 13, "an integer is too large"),
    ("m.msh", GMSH41.replace("1 1 2 3\n", "1 1 2 x\n"), 27, "found 'x' where an integer is expected"),
    ("m.msh", GMSH41.replace("4.1 0 8", "4.1 0 4"), 2, "the size of an integer is 4 bytes, 8 is expected"),
    ("m.msh", BINARY, 0, "the file has no $Nodes"),
    ("m.msh", BINARY.replace(struct.pack("<i", 1), struct.pack(">i", 1)), 0, "byte 25: the byte order is that of another kind of machine"),
    ("m.msh", BINARY + b"$Nodes\n" + struct.pack("<4Q", 1, 4, 1, 4) + b"\1\0\0\0", 0, "the file ends where a number is expected"),
    ("m.msh", BINARY + b"$Nodes\n" + struct.pack("<4Q", 1 << 60, 4, 1, 4) + b"\n$EndNodes\n", 0, "a count is impossible: the file does not hold that much"),
    ("m.msh", BINARY + b"$Nodes\n" + struct.pack("<4Q", 0, 0, 0, 0) + b"\n$EndNope\n", 0,
     "$EndNodes is expected here: the section $Nodes holds more than it announces, or less"),
    ("m.msh", GMSH22.replace("2 2 2 1 1 1 3 4", "2 2 2 1 1 2 1 3"), 0, "element 1 and element 2 are the same triangle: remove one of them"),
    ("m.msh", GMSH22.replace("$Nodes\n4", "$Nodes\n5").replace("$EndNodes", "5 0 0 0\n$EndNodes").replace("1 3 4", "5 3 4"), 0,
     "merge them, or allow coincident nodes if a slit is meant"),
    ("m.msh", bytes(range(256)), 1, "this is no Gmsh mesh"),
    ("m.xyz", "x y z\n", 1, "this is no Gmsh mesh: it does not begin with $MeshFormat"),
    ("m.stl", "", 1, "the file is empty"),
    ("m.stl", "solid x\nendsolid x\n", 0, "the file has no triangles"),
    ("m.stl", "solid x\nvertex 0 0 0\nendsolid x\n", 2, "found 'vertex' where facet or endsolid is expected"),
    ("m.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 a 0\nendloop\nendfacet\nendsolid x\n", 6,
     "found 'a' where a number is expected"),
    ("m.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid x\n", 6, "found 'endloop' where vertex is expected"),
    ("m.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n", 7, "the file ends too early"),
    ("m.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nvertex 0 0 0\nendloop\nendfacet\nendsolid x\n", 0,
     "all triangles have two corners at one place"),
    ("m.stl", b"\0" * 80 + struct.pack("<I", 5) + b"\0" * 50, 1, "where solid is expected"),
    ("m.stl", b"\0" * 80 + struct.pack("<I", 0), 0, "the file has no triangles"),
    ("m.stl", b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, float("nan"), 1, 0, 0), 0, "triangle 1: a coordinate is not finite"),
    ("m.stl", b"\0" * 40, 1, "where solid is expected"),
]
DECK = """*NODE, NSET=NALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
*ELEMENT, TYPE=S3, ELSET=EALL
1, 1, 2, 3
2, 1, 3, 4
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SHELL SECTION, ELSET=EALL, MATERIAL=M
0.1
*BOUNDARY
1, 1, 6
4, 1, 6
*STEP
*STATIC
*CLOAD
2, 3, 1.
*END STEP
"""
DECKS = [
    ("", 0, "the deck has no shells, membranes or plane elements (0 other elements)"),
    ("1, 2, 3\n" + DECK, 1, "this is no deck: a keyword (*...) is expected first"),
    (DECK.replace("2, 1., 0., 0.", "2, 1., x, 0."), 3, "x"),
    (DECK.replace("2, 1., 0., 0.", "two, 1., 0., 0."), 3, "*NODE: a node number and up to three coordinates are expected"),
    (DECK.replace("2, 1., 0., 0.", "1, 1., 0., 0."), 0, "the node 1 is there twice"),
    (DECK.replace("1, 1, 2, 3", "1, 1, two, 3"), 7, "found 'two' where the number of an element or node is expected"),
    (DECK.replace("2, 1., 0., 0.", "-2, 1., 0., 0."), 3, "a node number and up to three coordinates are expected"),
    (DECK.replace("1, 1, 2, 3", "1, 1, 2, 9"), 0, "element 1 refers to the node 9, which does not exist"),
    (DECK.replace("1, 1, 2, 3", "1, 1, 2"), 7, "an element of type S3 has its number and 3 nodes, found 2 nodes"),
    (DECK.replace("2, 1, 3, 4", "1, 1, 3, 4"), 0, "the element 1 is there twice, in lines 7 and 8"),
    (DECK.replace("TYPE=S3", "TYPE=Q99"), 0, "the deck has no shells, membranes or plane elements (2 other elements)"),
    (DECK.replace("TYPE=S3, ", ""), 0, "(2 other elements)"),
    (DECK.replace("*NODE, NSET=NALL", "*NODE, NSET=NALL, SYSTEM=C"), 1, "cylindrical and spherical coordinates are not taken (SYSTEM)"),
    (DECK.replace("*MATERIAL", "*NSET\n1\n*MATERIAL"), 9, "= name is expected"),
    (DECK.replace("*MATERIAL", "*NSET, NSET=A, GENERATE\n1\n*MATERIAL", 1), 10, "first, last and step of a range are expected"),
    (DECK.replace("*MATERIAL", "*SURFACE\nEALL, SPOS\n*MATERIAL", 1), 9, "NAME = name is expected"),
    (DECK.replace("*MATERIAL", "*INCLUDE\n*MATERIAL", 1), 9, "*INCLUDE needs INPUT = file"),
    (DECK.replace("*MATERIAL", "*INCLUDE, INPUT=none.inp\n*MATERIAL", 1), 9, "*INCLUDE: cannot open the file 'none.inp'"),
    (DECK.replace("*MATERIAL", "*INCLUDE, INPUT=m.inp\n*MATERIAL", 1), 0, "files are included 10 deep: does one include itself?"),
    (DECK.replace("*MATERIAL", "*INCLUDE, INPUT=n.inp\n1, 2\n*MATERIAL", 1), 10, "data after *INCLUDE; a keyword is expected"),
    (DECK.replace("*MATERIAL", "*INSTANCE, NAME=A, PART=P\n*END INSTANCE\n*INSTANCE, NAME=B, PART=P\n*END INSTANCE\n*MATERIAL", 1), 11,
     "a second instance; decks of one part and one instance are taken"),
    (DECK.replace("*NODE, NSET=NALL", "*HEADING"), 0, "element 1 refers to the node 1, which does not exist"),
    (DECK.replace("*ELEMENT, TYPE=S3, ELSET=EALL\n1, 1, 2, 3\n2, 1, 3, 4\n", ""), 0, "(0 other elements)"),
    (DECK.replace("2, 1., 0., 0.\n", "2, 1., 0., 0.\0\n"), 3, "a node number and up to three coordinates are expected"),
]

BALLOON = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 0, 90 azimuths = 0, 90 divisions = 4, 4 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0 density = 1.0 /
&section thickness = 0.1 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&chamber name = 'air' fluid = 'gas' ambient = 0.01 inflow = -600 /
"""
FLUNG = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 2, 2 /
&material name = 'm' law = 'linear_elastic' e = 1e3 nu = 0.3 density = 1.0 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 0, 0, 300 /
"""
SPIN = """&mesh generator = 'quadrilateral' corners = 0,0,0, 2,0,0, 3,1,1, 0,1,0 divisions = 2, 2 /
&material name = 'rubber' law = 'neo_hookean' mu = 1e6 density = 1.0 /
&section thickness = 0.1 type = 'membrane' /
&support node_set = 'edge_x0' fixed = 'ux', 'uy', 'uz' /
&rigid_body node_set = 'edge_x1' reference = 'hub' /
&node name = 'hub' position = 2.5, 0.5, 0.5 /
&spring name = 's' type = 'rotation' node_set = 'hub' stiffness = 1.0 /
&initial_velocity node_set = 'edge_x1' velocity = 0, 0, 1 /
&step control = 'dynamic' duration = 0.1 /
"""


class Malformed(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def refuse(self, file, line, words, *arguments):
        """Exit code 2, one sentence with the file, its line and words; no files of results."""
        before = {p: p.read_bytes() for p in self.path.iterdir() if p.is_file()}
        run = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, check=False, timeout=300, env=ENVIRONMENT,
                             errors="replace")
        said = run.stdout + run.stderr
        self.assertEqual(run.returncode, 2, said)
        self.assertEqual(run.stdout, "")
        self.assertTrue(run.stderr.startswith("finshell: "), said)
        self.assertEqual(len(run.stderr.splitlines()), 1, said)
        self.assertIsNone(re.search(r"Backtrace|runtime error|\bNaN\b(?!\b.{0,30}(expected|infinite))", run.stderr), said)
        if file:
            self.assertIn(file + (f":{line}:" if line else ""), said)
        self.assertIn(words, said)
        self.assertEqual({p: p.read_bytes() for p in self.path.iterdir() if p.is_file()}, before)
        if os.environ.get("FINSHELL_SHOW"):
            print(f"{file}:{line} | {words} | {run.stderr.strip()[:230]}")

    def test_namelists(self):
        for old, new, line, words in NAMELISTS:
            with self.subTest(old=old, new=new):
                self.assertIn(old, GOOD)
                (self.path / "model.nml").write_text(GOOD.replace(old, new, 1))
                self.refuse("model.nml", line, words, "check", "model.nml")

    def test_meshes(self):
        for file, content, line, words in MESHES:
            with self.subTest(content=content):
                (self.path / file).write_bytes(content if isinstance(content, bytes) else content.encode())
                (self.path / "model.nml").write_text(GOOD.replace(MESH, f"&mesh file = '{file}' /"))
                self.refuse(file, line, words, "check", "model.nml")
                (self.path / file).unlink()

    def test_load_on_a_shared_edge(self):
        inside = GMSH22.replace("$Elements\n2\n", "$Elements\n3\n3 1 2 5 5 1 3\n").replace("$Nodes", '$PhysicalNames\n2\n1 5 "cut"\n2 1 "sheet"\n$EndPhysicalNames\n$Nodes', 1)
        (self.path / "m.msh").write_text(inside)
        (self.path / "model.nml").write_text(f"&mesh file = 'm.msh' /\n{MATERIAL}\n{SECTION}\n&node_set name = 'foot' nodes = 1, 2 /\n"
                                             "&support node_set = 'foot' type = 'clamped' /\n"
                                             f"&load type = 'follower_line' edge_set = 'cut' in_plane = 1.0 /\n{STEP}\n")
        self.refuse("", 0, "elements meet: in the plane no side of it is outside", "check", "model.nml")

    def test_decks(self):
        (self.path / "n.inp").write_text("*HEADING\n")
        for content, line, words in DECKS:
            with self.subTest(content=content):
                (self.path / "m.inp").write_text(content)
                (self.path / "model.nml").write_text(GOOD.replace(MESH, "&mesh file = 'm.inp' /"))
                self.refuse("m.inp", line, words, "check", "model.nml")
                self.refuse("m.inp", line, words, "convert", "m.inp")

    def test_results(self):
        """Files of a run that were damaged or are others."""
        (self.path / "model.nml").write_text(GOOD)
        subprocess.run([PROGRAM, "run", "-q", "model.nml"], cwd=self.path, check=True, env=ENVIRONMENT, capture_output=True)
        whole = {end: (self.path / ("model" + end)).read_bytes() for end in (".restart", ".history.csv", ".vtkhdf")}
        restart = whole[".restart"]
        text = whole[".history.csv"].decode()
        rows = text.splitlines(keepends=True)
        values = rows[1].split(",")
        for end, content, line, words, commands in (
                (".restart", None, 0, "cannot restart: Cannot open file", ("restart",)),
                (".restart", b"", 0, "finshell has not written this file, or another version of it", ("restart", "info")),
                (".restart", b"finshell restart 9\n" + restart[19:], 0, "finshell has not written this file", ("restart", "info")),
                (".restart", restart[:27] + b"\x7f" * 8 + restart[35:], 0, "the file is damaged", ("restart", "info")),
                (".restart", restart[:200], 0, "the file is damaged", ("restart", "info")),
                (".restart", restart[:-9], 0, "the file is damaged", ("restart", "info")),
                (".restart", restart[:-1] + b"\x7f", 0, "the file is damaged", ("restart", "info")),
                (".restart", b"\0" * 4000, 0, "finshell has not written this file", ("restart", "info")),
                (".history.csv", b"", 1, "this is no history of a run: its first columns are not increment and load_factor", ("history", "info")),
                (".history.csv", b"a,b\n1,2\n", 1, "this is no history of a run", ("history", "info")),
                (".history.csv", (rows[0] + "1,2\n").encode(), 2, "values are expected, found 2", ("history", "info")),
                (".history.csv", (rows[0] + rows[1].replace(values[1], "x")).encode(), 2, "load_factor = \"x\": expected a number".replace('"', "'"),
                 ("history", "info")),
                (".history.csv", (rows[0] + rows[1].replace(values[1], "")).encode(), 2, "load_factor = '': expected a number", ("history", "info")),
                (".vtkhdf", b"", 0, "it is not an HDF5 file, or it is damaged", ("info",)),
                (".vtkhdf", whole[".vtkhdf"][:3000], 0, "it is not an HDF5 file, or it is damaged", ("info",)),
                (".vtkhdf", b"\0" * 3000, 0, "it is not an HDF5 file, or it is damaged", ("info",))):
            for command in commands:
                with self.subTest(command, end=end, content=content and content[:60]):
                    for name, good in whole.items():
                        (self.path / ("model" + name)).write_bytes(good)
                    if content is None:
                        (self.path / ("model" + end)).unlink()
                    else:
                        (self.path / ("model" + end)).write_bytes(content)
                    self.refuse("model" + end, line, words, command, "model")

    def test_places_that_are_taken(self):
        """Files that cannot be written, as a folder stands there; results that another run writes; what is there already."""
        taken = "x"
        more = "&monitor name = 'm' quantity = 'displacement' component = 'z' node_set = 'centre' /\n"
        accuracy = GOOD.replace(LOAD, "&load type = 'traction' vector = 0, 0, 0.1 /") + "&accuracy target = 0.001 most_elements = 200 /\n"
        for name, text, arguments, code, words in (
                ("model.history.csv", GOOD, ("run", "-q", "model.nml"), 2, "model.history.csv"),
                ("model~.vtkhdf", GOOD, ("run", "-q", "model.nml"), 2, "cannot create the result file: "),
                ("model.restart~", GOOD, ("run", "-q", "model.nml"), 2, "model.restart: cannot be written: "),
                ("model.meshes.csv", accuracy, ("run", "-q", "model.nml"), 1, "model.meshes.csv: cannot be written: "),
                ("model.sweep.csv", GOOD, ("run", "-q", "model.nml", "--set", "section.thickness=0.1,0.2"), 1, "model.sweep.csv: cannot be written: "),
                ("model.study.py", GOOD, ("study", "-q", "model.nml", "--levels", "2"), 1, "model.study.py: cannot be written"),
                ("model.msh", GOOD, ("mesh", "-q", "model.nml"), 2, "model.msh"),
                ("model.study/level_0.rung", GOOD, ("study", "model.nml", "--levels", "2"), 1, "level_0.rung: cannot be written")):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                (Path(folder) / name / taken).mkdir(parents=True)
                (Path(folder) / "model.nml").write_text(text + more)
                run = subprocess.run([PROGRAM, *arguments], cwd=folder, capture_output=True, text=True, check=False, timeout=300, env=ENVIRONMENT)
                self.assertEqual(run.returncode, code, run.stdout + run.stderr)
                self.assertIn(words, run.stdout + run.stderr)
                self.assertNotIn("Backtrace", run.stderr)
        (self.path / "model.nml").write_text(GOOD)
        (self.path / "model.msh").write_text(GMSH22)
        self.refuse("model.msh", 0, "the file is there already, and finshell has not written it; take another name", "mesh", "-q", "model.nml")
        (self.path / "model.study").write_text("")
        self.refuse("model.study", 0, "this folder cannot be made", "study", "-q", "model.nml")
        (self.path / "deck.inp").write_text(DECK)
        (self.path / "deck.nml").write_text("")
        self.refuse("deck.nml", 0, "it is not written: ", "convert", "deck.inp")
        with open(self.path / "model.lock", "w", encoding="utf-8") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.refuse("model.lock", 0, "wait for it, or take another name (name in &job) or folder (-o)", "run", "-q", "model.nml")
            (self.path / "model.history.csv").write_text("increment,load_factor\n1,1.0\n")
            run = subprocess.run([PROGRAM, "info", "model"], cwd=self.path, capture_output=True, text=True, check=True, env=ENVIRONMENT)
            self.assertIn("It runs now.", run.stdout)

    def test_large_file(self):
        """More than Fortran's default integers count; nothing of it is read."""
        with open(self.path / "model.nml", "wb") as file:
            file.truncate(3 * 1024**3)
        run = subprocess.run([PROGRAM, "check", "model.nml"], cwd=self.path, capture_output=True, text=True, check=False, timeout=300)
        self.assertEqual(run.returncode, 2)
        self.assertIn("cannot read the file 'model.nml': it is no ordinary file or larger than 2 GiB", run.stderr)

    def test_restart_with_another_input(self):
        (self.path / "model.nml").write_text(GOOD)
        subprocess.run([PROGRAM, "run", "-q", "model.nml"], cwd=self.path, check=True, env=ENVIRONMENT, capture_output=True)
        for old, new, line, words in (("thickness = 0.1", "thickness = 0.1 offset = 0.01", 3, "the run had no such key"),
                                      (LOAD, "&accuracy target = 0.1 /", 5, "&accuracy: a run that goes on keeps its mesh")):
            (self.path / "other.nml").write_text(GOOD.replace(old, new))
            self.refuse("other.nml", line, words, "restart", "model", "other.nml")

    def test_runs_that_stop(self):
        """What is found in the course of a run: exit code 1, one sentence."""
        for old, new, words in (
                (LOAD + "\n" + STEP, "&load type = 'pressure' pressure = 1.0 /\n&step control = 'buckling' /",
                 "pressure is not conservative, as part of the edge of the pressurised elements is free to move"),
                (GOOD, BALLOON + "&step control = 'explicit' duration = 0.1 /\n", "chamber 'air': more would be taken out than there is in it"),
                (GOOD, BALLOON + "&step control = 'dynamic' duration = 0.1 /\n", "chamber 'air': more would be taken out than there is in it"),
                (GOOD, BALLOON.replace("thickness = 0.1", "thickness = 0.1 type = 'membrane'").replace("mu = 1.0 density = 1.0", "mu = 0.01 density = 1000.0")
                 .replace("-600", "0") + "&initial_velocity node_set = 'all' velocity = 0, 0, -20 /\n"
                 "&step control = 'explicit' duration = 1.0 largest_increment = 0.01 /\n", "chamber 'air': there is no room left in it"),
                (GOOD, FLUNG + "&step control = 'dynamic' duration = 0.1 /\n", ": an increment of "),
                (GOOD, FLUNG + "&step control = 'dynamic' duration = 0.005 /\n&step load_factor = 2 /\n", "the motion before it does not come to rest"),
                (GOOD, SPIN, "dynamic: what is joined to a node has no inertia against its turning about some axis"),
                (STEP, "&step control = 'explicit' duration = 1.0 /\n&load type = 'pressure' pressure = 1e9 /",
                 "; or the motion is unstable and needs shorter increments (safety or largest_increment)"),
                ("load_factor = 1.0", "control = 'dynamic' duration = 1.0 first_increment = 0.1 maximum_increments = 2", "the most that are allowed")):
            with self.subTest(words):
                self.assertIn(old, GOOD)
                (self.path / "model.nml").write_text(GOOD.replace(old, new))
                run = subprocess.run([PROGRAM, "run", "-q", "model.nml"], cwd=self.path, capture_output=True, text=True, check=False, timeout=300,
                                     env=ENVIRONMENT)
                self.assertEqual(run.returncode, 1, run.stdout + run.stderr)
                self.assertIn(words, run.stderr)
                self.assertEqual(len(run.stderr.splitlines()), 1)

    def test_enough(self):
        self.assertGreaterEqual(len(NAMELISTS) + len(MESHES) + 2 * len(DECKS), 100)


if __name__ == "__main__":
    unittest.main()
