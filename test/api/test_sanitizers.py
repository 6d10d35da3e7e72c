#!/usr/bin/env python3
"""The C tests under valgrind's memcheck and with the address and undefined-behaviour sanitizers: no error, no leak. Threads of a
host with the thread sanitizer: no race (threads of OpenMP are left out, whose barriers it does not know).

The library is built anew for each sanitizer (kept in the build folder, so the second run is quick). Valgrind, which knows no 512-bit
instructions, sees the programs of the tests as they are where the library chooses by the processor.
"""
import glob
import os
import pathlib
import re
import shutil
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import installed  # noqa: E402

PROGRAMS = (("test_capi_errors", ()), ("test_capi_builder", ()), ("test_capi_sections", ()), ("test_capi_elements", ()),
            ("test_capi_physics", ()), ("test_capi_pressure", ()), ("test_capi_assembly", ()), ("test_capi_assembly_host", ("6",)),
            ("test_capi_batch", ("9",)), ("test_capi_fuzz", ("300",)), ("test_capi_guards", ("1", "memory")),
            ("test_section_guards", ("1", "memory")), ("test_assembly_guards", ("1", "memory")))  # a few elements are enough


def build(name, flags):
    """Library and test programs compiled with some flags; the folder they are in."""
    folder = os.path.join(installed.BINARY, "test", name)
    installed.run("cmake", "-G", "Ninja", "-S", installed.SOURCE, "-B", folder, "-DFINSHELL_DRIVER=OFF", "-DFINSHELL_TESTS=OFF",
                  "-DCMAKE_BUILD_TYPE=None", "-DFINSHELL_DISPATCH=OFF", "-DFINSHELL_BENCHMARKS=OFF",
                  f"-DCMAKE_Fortran_COMPILER={installed.FC}", f"-DCMAKE_C_COMPILER={installed.CC}",
                  f"-DCMAKE_Fortran_FLAGS=-std=f2018 -fimplicit-none -ffree-line-length-none {flags}")
    installed.run("cmake", "--build", folder, "--target", "finshell_static")
    library = glob.glob(os.path.join(folder, "**", "libfinshell.a"), recursive=True)[0]
    for program, _ in PROGRAMS:
        installed.run(installed.CC, "-std=c99", "-Wall", "-Wextra", *flags.split(), f"-I{installed.SOURCE}/api",
                      os.path.join(installed.SOURCE, "test", "api", program + ".c"), library, "-o", os.path.join(folder, program),
                      "-lgfortran", "-lgomp", "-lpthread", "-lm")
    return folder


def critical_procedures():
    """Linker names of the procedures of api/binding with a critical region."""
    found, regions = [], 0
    for path in sorted(glob.glob(os.path.join(installed.SOURCE, "api", "binding", "*.f90"))):
        with open(path, encoding="utf-8") as f:
            text = f.read()
            regions += text.count("!$omp critical (finshell_texts)\n")
            for body in re.split(r"\n(?=   (?:pure )?(?:function|subroutine) )", text):
                if "!$omp critical (finshell_texts)\n" not in body:
                    continue
                bound = re.search(r"bind\(c, name='(\w+)'\)", body)
                name = re.search(r"(?:function|subroutine) (\w+)", body).group(1)
                module = os.path.basename(path)[:-4]
                found.append(bound.group(1) if bound else f"__{module}_MOD_{name}")
    assert len(found) == regions > 7, found
    return found


class Clean(unittest.TestCase):
    def run_all(self, folder, *before, programs=PROGRAMS, prefix="", **environment):
        for program, arguments in programs:
            with self.subTest(program=program):
                for old in glob.glob(os.path.join(folder, "log.*")):
                    os.remove(old)
                # the programs catch what is printed on the standard streams
                try:
                    output = installed.run(*before, os.path.join(folder, prefix + program), *arguments, env=dict(os.environ, **environment))
                except AssertionError as e:
                    logs = "".join(pathlib.Path(log).read_text(errors="replace") for log in glob.glob(os.path.join(folder, "log.*")))
                    raise AssertionError(f"{e}\n{logs[:5000]}") from None
                self.assertIn(" 0 failures", output)

    def test_sanitizers(self):
        folder = build("sanitizers", "-g -O0 -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all")
        self.run_all(folder, UBSAN_OPTIONS=f"print_stacktrace=1:log_path={folder}/log",
                     ASAN_OPTIONS=f"detect_leaks=1:detect_stack_use_after_return=1:log_path={folder}/log")

    def test_thread_sanitizer(self):
        # The sanitizer does not see that critical regions of OpenMP exclude one another: what stands in them is suppressed.
        folder = build("threads", "-g -O0 -fsanitize=thread")
        suppressed = os.path.join(folder, "critical.txt")
        with open(suppressed, "w", encoding="utf-8") as f:
            f.writelines(f"race:^{name}$\n" for name in critical_procedures())
        self.run_all(folder, programs=(("test_capi_batch", ("0",)), ("test_capi_builder", ()), ("test_capi_assembly_host", ("0",)),
                                       ("test_capi_guards", ("2", "threads")), ("test_section_guards", ("2", "threads")),
                                       ("test_assembly_guards", ("2", "threads"))),
                     TSAN_OPTIONS=f"exitcode=9:suppressions={suppressed}:log_path={folder}/log",
                     OMP_NUM_THREADS="1")

    @unittest.skipUnless(shutil.which("valgrind"), "valgrind is not installed")
    def test_memcheck(self):
        prefix = ""
        if os.path.isdir(os.path.join(installed.BINARY, "dispatch")):
            folder, prefix = os.path.join(installed.BINARY, "test", "bin"), "api."
        else:
            folder = build("memcheck", "-g -O1")
        self.run_all(folder, "valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full",
                     "--errors-for-leak-kinds=definite,indirect", "--fair-sched=yes", f"--log-file={folder}/log.%p", prefix=prefix)


if __name__ == "__main__":
    unittest.main()
