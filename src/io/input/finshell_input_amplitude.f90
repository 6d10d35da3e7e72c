!> The groups &amplitude: tables that loads, supports and steps in time follow.
module finshell_input_amplitude
   use finshell_error, only: error_t, text_of
   use finshell_input_common, only: check_name
   use finshell_kinds, only: wp
   use finshell_namelist, only: check_all_used, complain_about, count_groups, get, group_t, has, namelist_t
   use finshell_table, only: table_t
   implicit none
   private
   public :: amplitude_t, read_amplitudes, get_amplitude

   type :: amplitude_t
      character(len=:), allocatable :: name
      integer :: line = 0
      type(table_t) :: table
      logical :: over_time = .false. !< else over the load factor
   end type amplitude_t

contains

   subroutine read_amplitudes(namelist, amplitudes, error)
      type(namelist_t), intent(inout) :: namelist
      type(amplitude_t), allocatable, intent(out) :: amplitudes(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, j, n
      allocate (amplitudes(count_groups(namelist, 'amplitude')))
      n = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'amplitude') cycle
         n = n + 1
         call read_amplitude(namelist%groups(i), amplitudes(n), error)
         if (allocated(error)) return
         do j = 1, n - 1
            if (amplitudes(j)%name /= amplitudes(n)%name) cycle
            call complain_about(namelist%groups(i), 'name', "there is an amplitude '"//amplitudes(n)%name//"' in line " &
                                //text_of(amplitudes(j)%line)//' already', error)
            return
         end do
      end do
   end subroutine read_amplitudes

   subroutine read_amplitude(group, amplitude, error)
      type(group_t), intent(inout) :: group
      type(amplitude_t), intent(out) :: amplitude
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: over
      real(wp), allocatable :: points(:)
      amplitude%line = group%line
      call get(group, 'name', amplitude%name, error)
      call check_name(group, 'name', amplitude%name, error)
      call get(group, 'over', over, error, default='load_factor', choices='load_factor, time')
      call get(group, 'smooth', amplitude%table%smooth, error, default=.false.)
      call get(group, 'points', points, error)
      call check_all_used(group, error)
      if (allocated(error)) return
      amplitude%over_time = over == 'time'
      if (mod(size(points), 2) /= 0 .or. size(points) < 4) then
         call complain_about(group, 'points', text_of(size(points))//' numbers were found; expected two points or more, each ' &
                             //merge('a time, and a factor       ', 'a load factor, and a factor', amplitude%over_time), error)
         return
      end if
      amplitude%table%x = points(1::2)
      amplitude%table%y = points(2::2)
      if (any(amplitude%table%x(2:) <= amplitude%table%x(:size(amplitude%table%x) - 1))) then
         call complain_about(group, 'points', merge('times       ', 'load factors', amplitude%over_time) &
                             //' of the points have to rise', error)
      else if (amplitude%over_time .and. amplitude%table%x(1) < 0) then
         call complain_about(group, 'points', 'times are not negative', error)
      end if
   end subroutine read_amplitude

   !> The amplitude that the key of this name names, 0 without the key.
   subroutine get_amplitude(group, amplitudes, at, error)
      type(group_t), intent(inout) :: group
      type(amplitude_t), intent(in) :: amplitudes(:)
      integer, intent(out) :: at
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: known, name
      integer :: i
      at = 0
      call get(group, 'amplitude', name, error, default='')
      if (allocated(error) .or. .not. has(group, 'amplitude')) return
      known = ''
      do i = 1, size(amplitudes)
         known = known//', '//amplitudes(i)%name
         if (amplitudes(i)%name == name) at = i
      end do
      if (known == '') known = ', (none)'
      if (at == 0) call complain_about(group, 'amplitude', "there is no &amplitude '"//name//"'; there are: "//known(3:), error)
   end subroutine get_amplitude
end module finshell_input_amplitude
