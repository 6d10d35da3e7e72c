!> The finshell program on many processes: mpirun -n N finshell_mpi run INPUT.nml
program finshell_mpi
   use finshell_driver, only: main
   use finshell_mpi_team, only: end_team, mpi_team_t, start_team
   implicit none
   type(mpi_team_t), target :: team
   integer :: code
   call start_team(team)
   call main(code, team)
   call end_team(team, code)
   stop code, quiet=.true.
end program finshell_mpi
