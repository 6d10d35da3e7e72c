# The UEL with recorded arguments: built as api/abaqus/Makefile builds it, called by test_uel_arguments.f90. The program says
# nothing when all is well, so whatever is written comes from the user element, which must not write.
set -euo pipefail
[ -n "${FINSHELL_LIB:-}" ] || { echo "skipped: there is no shared library"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
make -s -C "$FINSHELL_SOURCE_DIR/api/abaqus" BUILD="$folder" FC="$FINSHELL_FC" FINSHELL_LIB="$FINSHELL_LIB"
archive=$(dirname "$FINSHELL_LIB")/libfinshell.a
"$FINSHELL_FC" -g -fcheck=all -fopenmp -I"$folder" -J"$folder" -I"$FINSHELL_BINARY_DIR/modules" -ffree-line-length-none \
   -o "$folder/test" hosts/test_uel_arguments.f90 "$folder/libfinshell_uel.so" "$archive" -Wl,-rpath,"$folder"
"$folder/test" >"$folder/output" 2>&1 || { cat "$folder/output"; exit 1; }
if [ -s "$folder/output" ]; then
   cat "$folder/output"
   echo "something was written"
   exit 1
fi
