!> Takes a namelist file apart: groups `&name key = value, value ... /` that may repeat, with the line of everything.
!>
!> As in Fortran: names in either case, values separated by blanks, commas or ends of lines, strings in ' or " (a doubled quote
!> is a quote), repeat counts 3*0.0, comments from ! to the end of the line. Other than in Fortran, any text outside a group, an
!> empty value, a key given twice in a group or a string over several lines is an error.
module finshell_namelist_parser
   use finshell_error, only: error_t, text_of
   use finshell_text, only: figures, is_name, lower_case
   use finshell_namelist_scanner, only: cursor_t, check_characters, skip_space, take_word, take_string, at_key, next, excerpt
   use finshell_namelist_scanner, only: complain
   implicit none
   private
   public :: value_t, entry_t, group_t, namelist_t, parse_namelist

   !> One value as it stands in the file.
   type :: value_t
      character(len=:), allocatable :: text !< without quotes
      logical :: quoted = .false.
      integer :: line = 0
   end type value_t

   !> key = values
   type :: entry_t
      character(len=:), allocatable :: key !< lower case
      integer :: line = 0
      integer :: first = 0, last = 0 !< characters of the text that it takes
      type(value_t), allocatable :: values(:)
      logical :: used = .false.
   end type entry_t

   type :: group_t
      character(len=:), allocatable :: name !< lower case
      character(len=:), allocatable :: file !< where it stands, for messages
      integer :: line = 0
      integer :: last = 0 !< character of the text that closes it, the first one of &end
      type(entry_t), allocatable :: entries(:)
      character(len=:), allocatable :: known_keys !< the keys asked for so far, 'one, two'
   end type group_t

   type :: namelist_t
      character(len=:), allocatable :: file
      type(group_t), allocatable :: groups(:) !< in the order of the file
   end type namelist_t

   !> More than this is a mistake, and would take forever.
   integer, parameter :: most_values = 100000, most_keys = 1000, most_groups = 10000

contains

   !> Parse a text; file is the name used in messages. Errors are `FILE:LINE: what is wrong`.
   subroutine parse_namelist(text, file, nml, error)
      character(len=*), intent(in) :: text
      character(len=*), intent(in) :: file
      type(namelist_t), intent(out) :: nml
      type(error_t), allocatable, intent(out) :: error
      type(cursor_t) :: here
      type(group_t), allocatable :: groups(:)
      integer :: n

      nml%file = file
      allocate (nml%groups(0), groups(16))
      n = 0
      here%file = file
      here%text = text
      call check_characters(here, error)
      if (allocated(error)) return
      if (index(text, char(239)//char(187)//char(191)) == 1) here%at = 4 ! byte-order mark of UTF-8
      do
         call skip_space(here)
         if (here%at > len(text)) exit
         if (here%text(here%at:here%at) /= '&') then
            call complain(here, here%line, "found '"//excerpt(here)//"' outside of a group; a group begins with " &
               //"'&name' and ends with '/' (a string that contains / needs quotes)", error)
            return
         end if
         if (n == most_groups) then
            call complain(here, here%line, 'more than '//text_of(most_groups)//' groups', error)
            return
         end if
         n = n + 1
         if (n > size(groups)) call resize_groups(groups, 2*n)
         call parse_group(here, groups(n), error)
         if (allocated(error)) return
      end do
      call resize_groups(groups, n)
      call move_alloc(groups, nml%groups)
   end subroutine parse_namelist

   subroutine parse_group(here, group, error)
      type(cursor_t), intent(inout) :: here
      type(group_t), intent(out) :: group
      type(error_t), allocatable, intent(inout) :: error
      type(entry_t) :: entry
      character(len=:), allocatable :: word
      integer :: i

      group%file = here%file
      group%line = here%line
      group%known_keys = ''
      allocate (group%entries(0))
      here%at = here%at + 1
      call take_word(here, word)
      if (.not. is_name(word)) then
         call complain(here, group%line, "'&"//word//"' does not begin a group: & must be followed by its name", error)
         return
      end if
      group%name = lower_case(word)
      if (group%name == 'end') then
         call complain(here, group%line, '&end closes no group', error)
         return
      end if
      do
         if (ends_group(here, group, error)) return
         if (allocated(error)) return
         call parse_entry(here, group, entry, error)
         if (allocated(error)) return
         if (size(group%entries) == most_keys) then
            call complain(here, entry%line, '&'//group%name//': more than '//text_of(most_keys)//' keys', error)
            return
         end if
         do i = 1, size(group%entries)
            if (group%entries(i)%key /= entry%key) cycle
            call complain(here, entry%line, '&'//group%name//': the key '//entry%key//' is given twice, first in line ' &
               //text_of(group%entries(i)%line), error)
            return
         end do
         call append_entry(group%entries, entry)
      end do
   end subroutine parse_group

   !> Take the end of a group when it is next; an error when the file ends or another group begins.
   logical function ends_group(here, group, error)
      type(cursor_t), intent(inout) :: here
      type(group_t), intent(inout) :: group
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: found

      ends_group = .false.
      call skip_space(here)
      group%last = here%at
      if (here%at > len(here%text)) then
         call complain(here, group%line, '&'//group%name//' is not closed: a group ends with /, found the end of the file', error)
      else if (here%text(here%at:here%at) == '/') then
         here%at = here%at + 1
         ends_group = .true.
      else if (here%text(here%at:here%at) == '&') then
         found = excerpt(here)
         if (lower_case(found) == '&end') then
            here%at = here%at + 4
            ends_group = .true.
         else
            call complain(here, group%line, '&'//group%name//' is not closed: a group ends with /, found '//found//' in line ' &
               //text_of(here%line), error)
         end if
      end if
   end function ends_group

   subroutine parse_entry(here, group, entry, error)
      type(cursor_t), intent(inout) :: here
      type(group_t), intent(in) :: group
      type(entry_t), intent(out) :: entry
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word

      entry%line = here%line
      entry%first = here%at
      word = excerpt(here)
      call take_word(here, entry%key)
      call skip_space(here)
      if (entry%key == '' .or. next(here) /= '=') then
         call complain(here, entry%line, '&'//group%name//": found '"//word//"' where a key and = are expected" &
            //merge(' (strings need quotes)', '                      ', is_name(entry%key)), error)
         return
      end if
      if (.not. is_name(entry%key)) then
         call complain(here, entry%line, '&'//group%name//": '"//entry%key//"' is no name of a key (an index or component " &
            //'is not allowed)', error)
         return
      end if
      entry%key = lower_case(entry%key)
      here%at = here%at + 1
      call parse_values(here, group, entry, error)
   end subroutine parse_entry

   !> Values up to the next `key =`, `/`, `&` or the end of the text.
   subroutine parse_values(here, group, entry, error)
      type(cursor_t), intent(inout) :: here
      type(group_t), intent(in) :: group
      type(entry_t), intent(inout) :: entry
      type(error_t), allocatable, intent(inout) :: error
      type(value_t), allocatable :: values(:)
      type(value_t) :: value
      integer :: count_of_values, repeats, i
      logical :: after_comma

      allocate (values(8))
      count_of_values = 0
      after_comma = .true.
      do
         call skip_space(here)
         if (next(here) == ',') then
            if (after_comma) then
               call complain(here, here%line, '&'//group%name//' '//entry%key//': a value is missing before the comma', error)
               return
            end if
            after_comma = .true.
            here%at = here%at + 1
            cycle
         end if
         if (next(here) == '' .or. next(here) == '/' .or. next(here) == '&') exit
         if (at_key(here)) exit
         call take_value(here, group, entry%key, value, repeats, error)
         if (allocated(error)) return
         if (count_of_values + repeats > most_values) then
            call complain(here, here%line, '&'//group%name//' '//entry%key//': more than '//text_of(most_values)//' values', error)
            return
         end if
         if (count_of_values + repeats > size(values)) call resize_values(values, 2*(count_of_values + repeats))
         do i = 1, repeats
            count_of_values = count_of_values + 1
            values(count_of_values) = value
         end do
         entry%last = here%at - 1
         after_comma = .false.
      end do
      if (count_of_values == 0) then
         call complain(here, entry%line, '&'//group%name//' '//entry%key//': a value is missing after =', error)
         return
      end if
      call resize_values(values, count_of_values)
      call move_alloc(values, entry%values)
   end subroutine parse_values

   !> One value, perhaps with a repeat count.
   subroutine take_value(here, group, key, value, repeats, error)
      type(cursor_t), intent(inout) :: here
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      type(value_t), intent(out) :: value
      integer, intent(out) :: repeats
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word, where_it_is
      integer :: star, status, start

      where_it_is = '&'//group%name//' '//key//': '
      repeats = 1
      value%line = here%line
      if (scan(next(here), '''"') == 0) then
         start = here%at
         call take_word(here, word)
         star = index(word, '*')
         if (star > 1) then
            if (verify(word(:star - 1), figures) == 0) then
               read (word(:star - 1), *, iostat=status) repeats
               if (status /= 0 .or. repeats < 1 .or. repeats > most_values) then
                  call complain(here, value%line, where_it_is//"the repeat count of '"//word//"' must lie between 1 and " &
                     //text_of(most_values), error)
                  return
               end if
               here%at = start + star
               word = word(star + 1:)
               if (word /= '') here%at = here%at + len(word)
            end if
         end if
         value%text = word
         if (word == '' .and. scan(next(here), '''"') == 0) then
            call complain(here, value%line, where_it_is//"found '"//excerpt(here)//"' where a value is expected", error)
         end if
         if (word /= '' .or. allocated(error)) return
      end if
      call take_string(here, value%text, error)
      value%quoted = .true.
      if (allocated(error)) error%message = here%file//':'//text_of(value%line)//': '//where_it_is//error%message
   end subroutine take_value

   subroutine resize_values(values, n)
      type(value_t), allocatable, intent(inout) :: values(:)
      integer, intent(in) :: n
      type(value_t), allocatable :: resized(:)
      integer :: i
      allocate (resized(n))
      do i = 1, min(n, size(values))
         resized(i) = values(i)
      end do
      call move_alloc(resized, values)
   end subroutine resize_values

   subroutine append_entry(entries, entry)
      type(entry_t), allocatable, intent(inout) :: entries(:)
      type(entry_t), intent(in) :: entry
      type(entry_t), allocatable :: grown(:)
      integer :: i
      allocate (grown(size(entries) + 1))
      do i = 1, size(entries)
         grown(i) = entries(i)
      end do
      grown(size(grown)) = entry
      call move_alloc(grown, entries)
   end subroutine append_entry

   subroutine resize_groups(groups, n)
      type(group_t), allocatable, intent(inout) :: groups(:)
      integer, intent(in) :: n
      type(group_t), allocatable :: resized(:)
      integer :: i
      allocate (resized(n))
      do i = 1, min(n, size(groups))
         resized(i) = groups(i)
      end do
      call move_alloc(resized, groups)
   end subroutine resize_groups
end module finshell_namelist_parser
