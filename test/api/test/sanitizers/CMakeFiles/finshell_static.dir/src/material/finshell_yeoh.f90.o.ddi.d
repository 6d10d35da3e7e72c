/work/main/src/material/finshell_yeoh.f90:
