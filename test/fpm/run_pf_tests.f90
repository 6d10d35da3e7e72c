!> What `fpm test` runs: every .pf file of test/ that needs double precision only.
!>
!> fpm knows no preprocessing by other programs, so tools/fpm_tests translates the files into a package of their own,
!> build/fpm-tests, which has this one as its dependency, and lets fpm build and run that.
program run_pf_tests
   use, intrinsic :: iso_fortran_env, only: error_unit
   implicit none
   integer :: failed, not_started
   character(len=200) :: reason

   reason = ''
   call execute_command_line('tools/fpm_tests', exitstat=failed, cmdstat=not_started, cmdmsg=reason)
   if (not_started /= 0) then
      write (error_unit, '(2a)') 'tools/fpm_tests cannot be run: ', trim(reason)
      stop 1
   end if
   if (failed /= 0) stop 1
end program run_pf_tests
