#!/usr/bin/env bash
# The installed package as others see it: a CMake project that finds it builds a Fortran program on the static library; the
# shared library shows finshell_* only and needs nothing but runtimes; a C program builds by pkg-config.
set -euo pipefail
: "${FINSHELL_SOURCE_DIR:?}" "${FINSHELL_BINARY_DIR:?}" "${FINSHELL_FC:=gfortran}" "${FINSHELL_CC:=gcc}"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cmake --install "$FINSHELL_BINARY_DIR" --prefix "$folder/installed" >/dev/null
library=$(find "$folder/installed" -name libfinshell.so)
[[ -n $library ]] || { echo "no shared library was installed"; exit 1; }

if nm -D --defined-only "$library" | awk '$2 ~ /[A-Z]/ && $3 !~ /^(finshell_|FINSHELL_)/ { print $3; bad = 1 } END { exit bad }'; then
   echo "only finshell_* is visible"
else
   echo "the shared library shows the names above"
   exit 1
fi
needed=$(objdump -p "$library" | awk '/NEEDED/ { print $2 }')
for name in $needed; do
   case $name in
   libgfortran.so.* | libgomp.so.* | libquadmath.so.* | libm.so.* | libmvec.so.* | libc.so.* | libgcc_s.so.* | libpthread.so.* | ld-linux*) ;;
   *) echo "the shared library needs $name"; exit 1 ;;
   esac
done
objdump -p "$library" | grep -q 'SONAME *libfinshell.so.2$' || { echo "SONAME is not libfinshell.so.2"; exit 1; }

mkdir "$folder/user"
cat >"$folder/user/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES Fortran)
find_package(finshell REQUIRED)
add_executable(user user.f90)
target_link_libraries(user PRIVATE finshell::finshell_static)
CMAKE
cat >"$folder/user/user.f90" <<'FORTRAN'
program user
   use finshell_status, only: status_text, status_ok
   implicit none
   print '(a)', status_text(status_ok)
end program user
FORTRAN
export CMAKE_GENERATOR=Ninja
cmake -S "$folder/user" -B "$folder/user/build" -DCMAKE_PREFIX_PATH="$folder/installed" -DCMAKE_Fortran_COMPILER="$FINSHELL_FC" >/dev/null
cmake --build "$folder/user/build" >/dev/null
[[ $("$folder/user/build/user") == done ]] || { echo "the Fortran program did not work"; exit 1; }

if [[ -e $FINSHELL_SOURCE_DIR/api/finshell.h ]]; then
   export PKG_CONFIG_PATH="$(dirname "$library")/pkgconfig"
   printf '#include <finshell.h>\nint main(void) { return 0; }\n' >"$folder/user/user.c"
   # shellcheck disable=SC2046
   "$FINSHELL_CC" -std=c99 -Wall -Wextra -Wpedantic -Werror $(pkg-config --cflags finshell) "$folder/user/user.c" \
      -o "$folder/user/user_c" $(pkg-config --libs finshell)
   LD_LIBRARY_PATH=$(dirname "$library") "$folder/user/user_c" || { echo "the C program did not work"; exit 1; }
fi
if [[ -x $folder/installed/bin/finshell ]]; then
   for page in man/man1/finshell.1 bash-completion/completions/finshell zsh/site-functions/_finshell fish/vendor_completions.d/finshell.fish; do
      grep -q finshell "$folder/installed/share/$page" || { echo "no $page was installed"; exit 1; }
   done
fi
echo "installed package: usable"
