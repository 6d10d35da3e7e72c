# For Spack: copy this folder to packages/finshell of a repository of yours (`spack repo create`), then
# `spack dev-build finshell@0.1.0` in the sources, or give the class the url of a release.
from spack.package import *


class Finshell(CMakePackage, PythonExtension):
    """Thin shells of rubber and tissue at any strain and any rotation: the finite-strain corotational triangle of Caselli and Bisegna
    as a library for C, Fortran and Python, and as a program."""

    license("MIT", checked_by="finshell")

    version("0.1.0")

    variant("driver", default=True, description="Build the program finshell, not only the library")
    variant("python", default=True, description="Install the Python package")
    variant("dispatch", default=False, description="Compile the kernel for several processors and choose at run time")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    generator("ninja")

    # SuiteSparse solves; MUMPS is used by its names in Debian and conda-forge only (cmake/FindMUMPS.cmake).
    with when("+driver"):
        depends_on("hdf5+fortran~mpi")
        depends_on("blas")
        depends_on("lapack")
        depends_on("arpack-ng~mpi")
        depends_on("suite-sparse")

    with when("+python"):
        extends("python@3.9:")
        depends_on("py-pip", type="build")
        depends_on("py-flit-core@3.4:", type="build")
        depends_on("py-numpy@1.21:", type=("build", "run"))
        depends_on("py-h5py", type="run")
        depends_on("py-matplotlib@3.7:", type="run")
        depends_on("py-meshio", type="run")
        depends_on("py-scipy@1.8:", type="run")

    conflicts("%gcc@:11", msg="finshell needs gfortran 12 or later")

    def cmake_args(self):
        return [
            self.define_from_variant("FINSHELL_DRIVER", "driver"),
            self.define_from_variant("FINSHELL_DISPATCH", "dispatch"),
            self.define("FINSHELL_SUITESPARSE", True),
            self.define("FINSHELL_MUMPS", False),
            self.define("FINSHELL_TESTS", False),
            self.define("FINSHELL_BENCHMARKS", False),
            self.define("CMAKE_Fortran_FLAGS_RELEASE", "-O3 -fno-trapping-math -fno-math-errno"),
        ]

    @run_after("install")
    def install_python(self):
        if self.spec.satisfies("+python"):
            with working_dir(join_path(self.stage.source_path, "api", "python")):
                pip = Executable(self.spec["python"].command.path)
                pip("-m", "pip", "install", "--no-deps", "--no-build-isolation", f"--prefix={self.prefix}", ".")

    @run_after("install")
    @on_package_attributes(run_tests=True)
    def check_version(self):
        if self.spec.satisfies("+driver"):
            Executable(join_path(self.prefix.bin, "finshell"))("--version")
