!> The history of loads and supports of a deck as groups of a namelist.
module finshell_deck_acting
   use finshell_deck_history, only: boundary, entry_t, history_t, temperature
   use finshell_deck_schedule, only: apart, clock, perturbation, plain, riks, window
   use finshell_deck_temperature, only: write_temperature
   use finshell_deck_writer, only: number_text, quoted, vector_text, writer_t
   use finshell_error, only: text_of
   use finshell_kinds, only: wp
   implicit none
   private
   public :: write_history

   character, parameter :: lf = achar(10)
   character(len=2), parameter :: components(6) = ['ux', 'uy', 'uz', 'rx', 'ry', 'rz']

   !> A piece of a history: its steps, a number, and the words for when it acts.
   type :: piece_t
      character(len=:), allocatable :: set, key, when
      real(wp) :: value = 0
   end type piece_t

   !> Supports that wait to be joined.
   type :: pieces_t
      type(piece_t), allocatable :: list(:)
      integer :: count = 0 !< of them
   end type pieces_t

contains

   !> Supports, loads and amplitudes are added to the writer.
   subroutine write_history(history, writer)
      type(history_t), intent(in) :: history
      type(writer_t), intent(inout) :: writer
      type(pieces_t) :: pieces
      integer :: i, k

      allocate (pieces%list(16))
      do i = 1, history%count
         associate (entry => history%entries(i))
            if (history%schedule%way == plain .and. entry%kind /= boundary .and. abs(entry%magnitude) <= 0) cycle
            select case (history%schedule%way)
            case (plain)
               call add(entry, entry%magnitude, '', writer, pieces)
            case (apart)
               call write_apart(history, entry, writer, pieces)
            case (clock)
               k = max(1, entry%born)
               if (entry%kind /= boundary .and. history%schedule%steps(k)%kind == perturbation) then
                  associate (step => history%schedule%steps(k))
                     call add(entry, entry%magnitude, table_of([step%first, step%first + window], [0.0_wp, window], writer) &
                              //span(history, k, k), writer, pieces)
                  end associate
               else
                  call write_clock(history, entry, writer, pieces)
               end if
            end select
         end associate
      end do
      call write_supports(pieces, writer)
   end subroutine write_history

   !> Runs of steps of one value.
   subroutine write_apart(history, entry, writer, pieces)
      type(history_t), intent(in) :: history
      type(entry_t), intent(in) :: entry
      type(writer_t), intent(inout) :: writer
      type(pieces_t), intent(inout) :: pieces
      integer :: first, last
      last = 0
      do
         first = last + 1
         do while (first <= size(entry%value))
            if (entry%present(first)) exit
            first = first + 1
         end do
         if (first > size(entry%value)) return
         last = first
         do while (last < size(entry%value))
            if (.not. entry%present(last + 1) .or. abs(entry%value(last + 1) - entry%value(first)) > 0) exit
            last = last + 1
         end do
         if (entry%kind == boundary .or. abs(entry%value(first)) > 0) call add(entry, entry%value(first), &
                                                                              span(history, first, last), writer, pieces)
      end do
   end subroutine write_apart

   !> Tables over the load factor that counts the steps. A jump ends one and begins another.
   subroutine write_clock(history, entry, writer, pieces)
      type(history_t), intent(in) :: history
      type(entry_t), intent(in) :: entry
      type(writer_t), intent(inout) :: writer
      type(pieces_t), intent(inout) :: pieces
      real(wp), allocatable :: x(:), y(:)
      real(wp) :: change
      integer :: begun, i, k

      x = [real(wp) ::]
      y = [real(wp) ::]
      begun = 0
      do k = 1, size(entry%value)
         if (.not. entry%present(k)) then
            call close(k - 1)
            cycle
         end if
         associate (step => history%schedule%steps(k))
            if (begun > 0) then
               if (abs(entry%start(k) - y(size(y))) > 0 .and. entry%kind /= boundary) call close(k - 1)
            end if
            if (begun == 0) then
               begun = k
               x = [step%first]
               y = [entry%start(k)]
               if (entry%kind == boundary) y = [0.0_wp]
            end if
            if (step%kind == riks) then
               ! its own factor scales what it changes; supports stay
               change = entry%value(k) - entry%start(k)
               if (entry%kind /= boundary .and. abs(change) > 0) call add(entry, change, " case = 'step_" &
                                                                          //text_of(step%number)//"'", writer, pieces)
               y(size(y)) = entry%start(k)
               cycle
            end if
            if (.not. step%last > step%first) cycle
            if (step%ramp > step%first) call point(step%ramp, entry%start(k))
            if (allocated(entry%corners(k)%times)) then
               do i = 1, size(entry%corners(k)%times)
                  call point(step%ramp + (step%last - step%ramp)*entry%corners(k)%times(i)/step%duration, &
                             entry%corners(k)%values(i))
               end do
            end if
            call point(step%last, entry%value(k))
         end associate
      end do
      call close(size(entry%value))

   contains

      subroutine point(at, value)
         real(wp), intent(in) :: at, value
         if (at <= x(size(x))) return
         x = [x, at]
         y = [y, value]
      end subroutine point

      !> The table from step `begun` to this one.
      subroutine close(until)
         integer, intent(in) :: until
         real(wp) :: peak
         character(len=:), allocatable :: when
         if (begun == 0) return
         when = span(history, begun, until)
         ! a table that is zero at both ends says it all
         if (entry%kind /= boundary .and. abs(y(1)) + abs(y(size(y))) <= 0) when = ''
         if (entry%kind /= boundary .and. abs(y(1)) <= 0 .and. until == size(entry%value)) when = ''
         if (all(abs(y) <= 0)) then
            if (entry%kind == boundary) call add(entry, 0.0_wp, when, writer, pieces)
         else
            peak = y(maxloc(abs(y), dim=1))
            if (entry%form == 3) peak = abs(peak) ! the root of it is written
            ! one line from 0 on is what the load factor does by itself
            if (size(x) == 2 .and. abs(x(1)) + abs(y(1)) <= 0 .and. x(size(x)) >= history%schedule%steps(size(entry%value))%last) &
               then
               call add(entry, y(2)/x(2), when, writer, pieces)
            else
               if (size(x) == 1) then
                  x = [x, x + 1]
                  y = [y, y]
               end if
               call add(entry, peak, table_of(x, y/peak + 0.0_wp, writer)//when, writer, pieces)
            end if
         end if
         begun = 0
      end subroutine close
   end subroutine write_clock

   !> The steps in which something is there; '': all of them.
   pure function span(history, first, last) result(text)
      type(history_t), intent(in) :: history
      integer, intent(in) :: first, last
      character(len=:), allocatable :: text
      integer :: a, b
      associate (steps => history%schedule%steps)
         ! those of the namelist
         a = 1 + count(steps(:first - 1)%number > 0)
         b = count(steps(:last)%number > 0)
      end associate
      text = ''
      if (a > 1) text = ' from_step = '//text_of(a)
      if (b < history%schedule%count) text = text//' until_step = '//text_of(max(a, b))
   end function span

   !> The key for a table, which is written once.
   function table_of(x, y, writer) result(text)
      real(wp), intent(in) :: x(:), y(:)
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: text, points
      integer :: at, i, n
      logical :: needed
      points = ''
      do i = 1, size(x)
         needed = i == 1 .or. i == size(x)
         if (.not. needed) needed = abs((y(i) - y(i - 1))*(x(i + 1) - x(i)) - (y(i + 1) - y(i))*(x(i) - x(i - 1))) > 0
         if (needed) points = points//',  '//number_text(x(i))//', '//number_text(y(i))
      end do
      points = ' points = '//points(4:)//' /'//lf
      at = index(writer%amplitudes, points)
      if (at == 0) then
         n = 1
         do i = 1, len(writer%amplitudes)
            if (writer%amplitudes(i:i) == lf) n = n + 1
         end do
         text = "'history_"//text_of(n)//"'"
         writer%amplitudes = writer%amplitudes//'&amplitude name = '//text//points
      else
         text = writer%amplitudes(:at - 1)
         text = text(index(text, "'history_", back=.true.):)
      end if
      text = ' amplitude = '//text
   end function table_of

   !> A number of an entry, and when it acts.
   subroutine add(entry, value, when, writer, pieces)
      type(entry_t), intent(in) :: entry
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: when
      type(writer_t), intent(inout) :: writer
      type(pieces_t), intent(inout) :: pieces
      character(len=:), allocatable :: number, set
      type(piece_t), allocatable :: grown(:)
      set = entry%set
      if (.not. entry%whole) set = writer%list_set(entry%set_key, entry%members)
      if (entry%kind == boundary) then
         if (pieces%count == size(pieces%list)) then
            allocate (grown(2*pieces%count))
            grown(:pieces%count) = pieces%list
            call move_alloc(grown, pieces%list)
         end if
         pieces%count = pieces%count + 1
         associate (piece => pieces%list(pieces%count))
            piece%set = set
            piece%key = entry%key
            piece%when = when
            piece%value = value
         end associate
         return
      end if
      if (entry%kind == temperature) then
         call write_temperature(set, entry%members, value, when, writer)
         return
      end if
      select case (entry%form)
      case (2); number = vector_text(value*entry%direction + 0.0_wp)
      case (3); number = number_text(sqrt(max(value, 0.0_wp)))
      case default; number = number_text(value)
      end select
      writer%loads = writer%loads//entry%before//' '//entry%set_key//' = '//quoted(set)//' '//entry%after//' = '//number &
         //entry%more//when//' /'//lf
   end subroutine add

   !> Components of one set and one time in one group.
   subroutine write_supports(pieces, writer)
      type(pieces_t), intent(inout) :: pieces
      type(writer_t), intent(inout) :: writer
      integer, parameter :: ahead = 64 ! pieces that are looked at: those of one set are written one behind the other
      logical :: done(pieces%count + ahead), mine(0:ahead)
      character(len=:), allocatable :: fixed, moved
      integer :: c, held, i, j
      done = .false.
      do i = 1, pieces%count
         if (done(i)) cycle
         mine = .false.
         do j = 0, min(ahead, pieces%count - i)
            if (done(i + j)) cycle
            mine(j) = pieces%list(i + j)%set == pieces%list(i)%set .and. pieces%list(i + j)%when == pieces%list(i)%when
            done(i + j) = mine(j)
         end do
         fixed = ''
         moved = ''
         held = 0
         do c = 1, size(components)
            do j = 0, ahead
               if (.not. mine(j)) cycle
               associate (piece => pieces%list(i + j))
                  if (piece%key /= components(c)) cycle
                  if (abs(piece%value) > 0) then
                     moved = moved//' '//components(c)//' = '//number_text(piece%value)
                  else
                     fixed = fixed//' '//quoted(components(c))
                     held = held + 1
                  end if
               end associate
               exit
            end do
         end do
         if (held > 0) fixed = ' fixed ='//fixed
         if (held == size(components)) fixed = " type = 'clamped'"
         writer%supports = writer%supports//'&support node_set = '//quoted(pieces%list(i)%set)//fixed//moved//pieces%list(i)%when &
            //' /'//lf
      end do
   end subroutine write_supports
end module finshell_deck_acting
