/work/main/src/batch/finshell_batch.f90:
