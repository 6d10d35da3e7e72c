#!/usr/bin/env python3
"""api/finshell_c.f90, the C interface for any Fortran compiler: it says what the header says, and programs that use it compute
what a program in C does, with the compiler of the library and with flang when it is installed."""
import ctypes
import importlib.util
import os
import re
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import installed  # noqa: E402

MODULE = os.path.join(installed.SOURCE, "api", "finshell_c.f90")
LIBRARY = os.environ.get("FINSHELL_LIB", "")
FLANG = next((path for path in map(shutil.which, ("flang-new", "flang", "flang-new-19", "flang-19")) if path), None)
STRUCTURES = ("status", "parameter", "layer", "elements", "field_entry")
# What an argument of the header is in Fortran (name left out).
KINDS = {
    "int32_t": "integer(c_int32_t), value", "double": "real(c_double), value",
    "const double *": "real(c_double), intent(in), optional (*)", "double *": "real(c_double), intent(out), optional (*)",
    "int32_t *": "integer(c_int32_t), intent(out), optional (*)", "finshell_status *": "type(finshell_status), intent(out), optional",
    "const char *": "character(kind=c_char), intent(in) (*)", "char *": "character(kind=c_char), intent(inout), optional (*)",
    "const char *const *": "type(c_ptr), intent(in), optional (*)", "const finshell_section *": "type(c_ptr), value",
    "finshell_section *": "type(c_ptr), value", "finshell_section **": "type(c_ptr), intent(out)",
    "const finshell_layer *": "type(finshell_layer), intent(in), optional (*)",
    "const finshell_elements *": "type(finshell_elements), intent(in)",
    "finshell_parameter *": "type(finshell_parameter), intent(out), optional",
    "finshell_field_entry *": "type(finshell_field_entry), intent(out), optional"}
PROGRAM = """program square
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int32_t, c_loc, c_null_char, c_null_ptr, c_ptr, c_sizeof
   use finshell_c
   implicit none
   character(kind=c_char, len=4), target :: names(3) = ['c10'//c_null_char, 'c01'//c_null_char, 'mu'//c_null_char//' ']
   character(kind=c_char, len=10), target :: options(2) = ['membrane'//c_null_char//' ', 'wrinkling'//c_null_char]
   type(c_ptr) :: section, sheet
   type(finshell_status) :: status
   type(finshell_elements) :: elements
   real(c_double), target :: x(3, 3, 2), u(3, 3, 2), t(3, 3, 2), normals(3, 3, 2)
   real(c_double) :: energy(2), force(18, 2), tangent(18, 18, 2), again(18, 2), moment(3, 2), volume(2), facets(2)
   real(c_double) :: membrane(3, 2), found(3, 2), nine(9, 2)
   integer(c_int32_t) :: code, state(2)

   if (finshell_abi() /= finshell_abi_number) error stop 'library and module do not fit'
   x = reshape([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0], [3, 3, 2])
   u = 0
   t = 0
   u(1, :, :) = 0.2_c_double*x(1, :, :)
   t(2, :, :) = -0.1_c_double*x(1, :, :)
   code = finshell_section_create('mooney_rivlin'//c_null_char, 2, [c_loc(names(1)), c_loc(names(2))], &
                                  [80.0_c_double, 20.0_c_double], 0.1_c_double, 0, section=section, status=status)
   if (code /= finshell_ok) error stop 'no section'
   code = finshell_evaluate(section, 2, x, u, t, finshell_rotation_vector, energy=energy, force=force, tangent=tangent, &
                            threads=1, status=status)
   elements%size = c_sizeof(elements)
   elements%n = 2
   elements%convention = finshell_rotation_vector
   elements%threads = 1
   elements%x = c_loc(x)
   elements%u = c_loc(u)
   elements%rotations = c_loc(t)
   if (finshell_elements_recover(section, elements, membrane_force=membrane) /= finshell_ok) error stop 'not recovered'
   if (finshell_recover_field(section, elements, 'membrane_force'//c_null_char, found) /= finshell_ok) error stop 'no field'
   if (.not. all(abs(membrane) > 0) .or. any(abs(membrane - found) > 0)) error stop 'field differs'
   normals = spread(reshape([0, 0, 0, 0, 0, 0, 1, 1, 1], [3, 3], order=[2, 1]), 3, 2)
   elements%normals = c_loc(normals)
   if (finshell_elements_evaluate(section, elements, force=again, status=status) /= finshell_ok) error stop 'block refused'
   if (any(abs(force - again) > 1e-13_c_double)) error stop 'flat elements differ'
   normals(1, 1, :) = 0.3_c_double
   if (finshell_elements_evaluate(section, elements, force=again) /= finshell_ok) error stop 'curved block refused'
   if (.not. all(abs(force - again) > 0)) error stop 'normals do not count'
   if (finshell_elements_recover(section, elements, moment=moment) /= finshell_ok) error stop 'not recovered'
   if (finshell_elements_pressure(elements, form=1, volume=volume) /= finshell_ok) error stop 'no volume'
   if (finshell_elements_pressure(elements, [1.0_c_double, 1.0_c_double], 0, force=again) /= finshell_ok) error stop 'no pressure'
   elements%normals = c_null_ptr
   if (finshell_elements_pressure(elements, form=1, volume=facets) /= finshell_ok) error stop 'no volume of facets'
   if (.not. all(abs(volume - facets) > 0)) error stop 'no caps'
   if (.not. maxval(abs(again(4:6, :))) > 0) error stop 'no couples'
   elements%rotations = c_null_ptr
   code = finshell_section_create('neo_hookean'//c_null_char, 1, [c_loc(names(3))], [2.0_c_double], 0.1_c_double, 2, &
                                  [c_loc(options(1)), c_loc(options(2))], [1.0_c_double, 1.0_c_double], sheet, status)
   if (code /= finshell_ok) error stop 'no membrane'
   if (finshell_section_freedoms(sheet) /= 9 .or. finshell_section_freedoms(section) /= 18) error stop 'wrong freedoms'
   if (finshell_elements_evaluate(sheet, elements, force=nine, status=status) /= finshell_ok) error stop 'membrane refused'
   if (.not. nine(4, 1) > 0) error stop 'membrane without force'
   if (finshell_elements_wrinkles(sheet, elements, state) /= finshell_ok) error stop 'no wrinkles'
   if (any(state /= finshell_sheet_taut)) error stop 'not taut'
   call finshell_section_destroy(sheet)
   elements%rotations = c_loc(t)
   elements%size = elements%size + 1
   if (finshell_elements_recover(section, elements, moment=moment) /= finshell_invalid_argument) error stop 'wrong size taken'
   call finshell_section_destroy(section)
   if (code /= finshell_ok .or. status%index /= -1) error stop 'not evaluated'
   print '(a, es21.14)', 'energy ', sum(energy)
   print '(a, es21.14)', 'force ', force(7, 1) + force(13, 1) + force(7, 2)
   print '(a, es21.14)', 'moment ', force(11, 1) + force(17, 1) + force(11, 2)
   print '(a, es21.14)', 'stiffness ', tangent(7, 7, 1)
end program square
"""


class Interface(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(os.path.join(installed.SOURCE, "api", "finshell.h"), encoding="utf-8") as f:
            cls.header = re.sub(r"/\*.*?\*/", "", f.read(), flags=re.S)
        with open(MODULE, encoding="utf-8") as f:
            cls.module = re.sub(r" *!.*", "", f.read())
        cls.module = re.sub(r" *&\n *", " ", cls.module)

    def test_functions(self):
        expected = re.findall(r"^(const char \*|int32_t |void )(finshell_\w+)\(([^)]*)\);", self.header, re.M)
        bodies = {name: (arguments, body) for name, arguments, body in
                  re.findall(r"(?:function|subroutine) (finshell_\w+)\((.*?)\)(?: result\(\w+\))? bind\(c\)\n(.*?)\n *end ", self.module, re.S)}
        self.assertEqual(set(bodies), {name for _, name, _ in expected})
        for result, name, arguments in expected:
            with self.subTest(name=name):
                listed, body = bodies[name]
                wanted = []
                for argument in ([] if arguments == "void" else arguments.split(",")):
                    kind, variable = re.fullmatch(r"(.*?)(\w+)", " ".join(argument.split())).groups()
                    kind = KINDS[kind.strip()]
                    if name == "finshell_rotation_update" and variable == "quaternion":
                        kind = kind.replace("out", "inout")
                    wanted.append((variable.lower(), kind))
                self.assertEqual([a.strip() for a in listed.split(",") if a.strip()], [variable for variable, _ in wanted])
                for variable, kind in wanted:
                    found = re.search(rf"^ *(.*?) :: {variable}(\(\*\))?$", body, re.M)
                    self.assertEqual(f"{found.group(1)} {found.group(2) or ''}".strip(), kind, msg=variable)
                kind = {"int32_t": "integer(c_int32_t)", "const char *": "type(c_ptr)", "void": None}[result.strip()]
                if kind:
                    self.assertEqual(body.rstrip().splitlines()[-1].split("::")[0].strip(), kind)

    def test_numbers(self):
        for name, value in re.findall(r"(FINSHELL_\w+) = (-?\d+)", self.header):
            self.assertIn(f"{name.lower()} = {value}\n", self.module)
        self.assertIn(f"finshell_abi_number = {re.search(r'FINSHELL_ABI (.)', self.header).group(1)}\n", self.module)

    def test_structures(self):
        for name in STRUCTURES:
            fields = re.search(rf"typedef struct finshell_{name} \{{(.*?)\}}", self.header, re.S).group(1)
            names = [re.search(r"(\w+)(\[\d+\])?$", f.strip()).group(0).replace("[", "(").replace("]", ")") for f in fields.split(";") if f.strip()]
            names = [n.lower() for n in names]
            body = re.search(rf"type, bind\(c\) :: finshell_{name}\n(.*?)\n *end type", self.module, re.S).group(1)
            self.assertEqual([re.sub(r" = .*", "", line.split("::")[1]).strip() for line in body.splitlines()], names)

    def test_layout(self):
        # size of each structure and place of each member, by the compilers of C and Fortran and by ctypes
        members = {}
        for name in STRUCTURES:
            fields = re.search(rf"typedef struct finshell_{name} \{{(.*?)\}}", self.header, re.S).group(1)
            members[name] = re.findall(r"(\w+)(?:\[\d+\])?;", fields)
        self.assertEqual(members["elements"][:3] + members["elements"][-1:], ["size", "n", "convention", "growth"])
        c = ["#include <finshell.h>", "#include <stddef.h>", "#include <stdio.h>", "int main(void)", "{"]
        fortran = ["program layout", "use, intrinsic :: iso_c_binding", "use finshell_c", "implicit none"]
        fortran += [f"type(finshell_{name}), target :: {name}_" for name in members]
        for name, fields in members.items():
            c.append(f'printf("{name} %d\\n", (int)sizeof(finshell_{name}));')
            c += [f'printf("{name}.{field} %d\\n", (int)offsetof(finshell_{name}, {field}));' for field in fields]
            fortran.append(f"print '(a, i0)', '{name} ', c_sizeof({name}_)")
            fortran += [f"print '(a, i0)', '{name}.{field} ', transfer(c_loc({name}_%{field}), 0_c_intptr_t) &\n"
                        f"   - transfer(c_loc({name}_), 0_c_intptr_t)" for field in fields]
        with tempfile.TemporaryDirectory() as folder:
            for file, lines in (("layout.c", c + ["return 0;", "}"]), ("layout.f90", fortran + ["end program layout"])):
                with open(os.path.join(folder, file), "w", encoding="utf-8") as f:
                    f.write("\n".join(lines) + "\n")
            installed.run(installed.CC, "-std=c99", f"-I{installed.SOURCE}/api", "layout.c", "-o", "layout_c", cwd=folder)
            installed.run(installed.FC, MODULE, "layout.f90", "-o", "layout_f", cwd=folder)
            found = [installed.run(os.path.join(folder, program)).split("\n") for program in ("layout_c", "layout_f")]
        self.assertEqual(found[0], found[1])
        self.assertEqual(len(found[0]) - 1, sum(map(len, members.values())) + len(members))
        if importlib.util.find_spec("numpy"):
            sys.path.insert(0, os.path.join(installed.SOURCE, "api", "python"))
            from finshell import _library
            by_ctypes = {"status": _library.Status, "parameter": _library.CParameter, "layer": _library.CLayer,
                         "elements": _library.CElements, "field_entry": _library.CField}
            lines = []
            for name, fields in members.items():
                lines.append(f"{name} {ctypes.sizeof(by_ctypes[name])}")
                lines += [f"{name}.{field} {getattr(by_ctypes[name], field).offset}" for field in fields]
            self.assertEqual(found[0][:-1], lines)

    def run_program(self, compiler, *options):
        with tempfile.TemporaryDirectory() as folder:
            source, program = os.path.join(folder, "square.f90"), os.path.join(folder, "square")
            with open(source, "w", encoding="utf-8") as f:
                f.write(PROGRAM)
            libraries = os.path.dirname(LIBRARY)
            installed.run(compiler, *options, MODULE, source, "-o", program, LIBRARY, f"-Wl,-rpath,{libraries}", cwd=folder)
            lines = installed.run(program).splitlines()
        found = {line.split()[0]: float(line.split()[1]) for line in lines}
        # those of doc/c_api.md, which test_doc_examples.py compares with one another
        sys.path.insert(0, os.path.join(installed.SOURCE, "api", "python"))
        import numpy as np
        os.environ["FINSHELL_LIB"] = LIBRARY
        import finshell
        X = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], dtype=float)
        u, t = np.zeros((2, 3, 3)), np.zeros((2, 3, 3))
        u[:, :, 0], t[:, :, 1] = 0.2 * X[:, :, 0], -0.1 * X[:, :, 0]
        r = finshell.Section("mooney_rivlin", {"c10": 80.0, "c01": 20.0}, thickness=0.1).evaluate(X, u, t)
        self.assertAlmostEqual(found["energy"], r.energy.sum(), delta=1e-12)
        self.assertAlmostEqual(found["force"], r.force[0, 6] + r.force[0, 12] + r.force[1, 6], delta=1e-12)
        self.assertAlmostEqual(found["moment"], r.force[0, 10] + r.force[0, 16] + r.force[1, 10], delta=1e-12)
        self.assertAlmostEqual(found["stiffness"], r.tangent[0, 6, 6], delta=1e-11)

    def test_program(self):
        self.run_program(installed.FC, *(["-std=f2018", "-Wall", "-Wextra", "-Werror"] if "gfortran" in installed.FC else []))

    @unittest.skipUnless(FLANG, "flang is not installed")
    def test_program_by_flang(self):
        self.run_program(FLANG)


if __name__ == "__main__":
    unittest.main()
