!> The finshell program; everything is in finshell_driver.
program finshell_main
   use finshell_driver, only: main
   implicit none
   integer :: code
   call main(code)
   stop code, quiet=.true.
end program finshell_main
