!> Input decks of Abaqus and CalculiX as a list of cards: a keyword with its parameters, and the lines of data that follow it.
module finshell_deck
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: i8, wp
   use finshell_status, only: status_input_error
   use finshell_text, only: is_blank, parse_integer, parse_real, read_whole_file
   implicit none
   private
   public :: deck_t, card_t, data_t, word_t, read_deck, parse_deck

   type :: word_t
      character(len=:), allocatable :: text
   end type word_t

   !> A file that the deck consists of.
   type :: source_t
      character(len=:), allocatable :: file, bytes
   end type source_t

   type :: card_t
      character(len=:), allocatable :: keyword !< in capitals, one blank between words
      type(word_t), allocatable :: names(:) !< of parameters, in capitals
      type(word_t), allocatable :: values(:) !< of parameters; '' where there is none
      integer :: source = 0 !< file
      integer :: line = 0 !< of the keyword
      integer :: first = 1, last = 0 !< bytes of the data
      integer :: data_line = 0 !< of the first line of data
   contains
      procedure :: has
      procedure :: value
   end type card_t

   type :: deck_t
      type(source_t), allocatable :: sources(:)
      type(card_t), allocatable :: cards(:)
      integer, private :: count = 0 !< of them while they are read
   contains
      procedure, private :: add_card
      procedure :: complain
      procedure :: start
      procedure :: next
   end type deck_t

   !> Where a reader of the data of a card is, and the fields of the line it has read.
   type :: data_t
      integer :: card = 0
      integer :: at = 1, line = 0 !< of the next line
      integer :: fields = 0
      type(word_t), allocatable :: field(:)
      logical :: goes_on = .false. !< the line ends with a comma
   contains
      procedure :: number
      procedure :: whole
   end type data_t

   integer, parameter :: deepest = 10 !< files that include files

contains

   !> Read a deck with all that it includes. Errors: files that are missing, include themselves, or are no deck.
   recursive subroutine read_deck(file_name, deck, error, depth)
      character(len=*), intent(in) :: file_name
      type(deck_t), intent(inout) :: deck
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: depth
      character(len=:), allocatable :: bytes
      integer :: level
      level = 1
      if (present(depth)) level = depth
      if (level > deepest) then
         call raise(error, status_input_error, file_name//': files are included '//text_of(deepest) &
            //' deep: does one include itself?')
         return
      end if
      call read_whole_file(file_name, bytes, error)
      if (.not. allocated(error)) call parse_deck(bytes, file_name, deck, error, level)
   end subroutine read_deck

   !> Add the cards of a text.
   recursive subroutine parse_deck(bytes, file, deck, error, depth)
      character(len=*), intent(in) :: bytes, file
      type(deck_t), intent(inout) :: deck
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in) :: depth
      character(len=:), allocatable :: header
      type(card_t) :: card
      integer :: at, begin, line, source, tail

      if (.not. allocated(deck%sources)) allocate (deck%sources(0), deck%cards(64))
      deck%sources = [deck%sources, source_t(file, bytes)]
      source = size(deck%sources)
      at = 1
      line = 0
      do while (at <= len(bytes))
         begin = at
         call end_of_line(bytes, at, tail)
         line = line + 1
         if (is_comment(bytes(begin:tail))) cycle
         if (bytes(begin:begin) /= '*') then
            if (deck%count == 0 .and. len_trim(bytes(begin:tail)) > 0) then
               call raise(error, status_input_error, file//':'//text_of(line)//': this is no deck: a keyword ' &
                  //'(*...) is expected first')
               return
            end if
            if (deck%count > 0) then
               associate (last => deck%cards(deck%count))
                  if (last%source /= source) then
                     ! data that go on behind an included file
                     if (len_trim(bytes(begin:tail)) > 0) call raise(error, status_input_error, file//':'//text_of(line) &
                        //': data after *INCLUDE; a keyword is expected')
                     if (allocated(error)) return
                  else
                     if (last%data_line == 0) then
                        last%data_line = line
                        last%first = begin
                     end if
                     last%last = tail
                  end if
               end associate
            end if
            cycle
         end if
         card = card_t(source=source, line=line)
         header = bytes(begin + 1:tail)
         do while (ends_with_comma(header) .and. at <= len(bytes))
            begin = at
            call end_of_line(bytes, at, tail)
            line = line + 1
            header = header//bytes(begin:tail)
         end do
         call read_header(header, card)
         if (card%keyword == 'INCLUDE') then
            if (card%value('INPUT') == '') then
               call raise(error, status_input_error, file//':'//text_of(card%line)//': *INCLUDE needs INPUT = file')
            else if (index(card%value('INPUT'), '/') == 1) then
               call read_deck(card%value('INPUT'), deck, error, depth + 1)
            else
               call read_deck(file(:index(file, '/', back=.true.))//card%value('INPUT'), deck, error, depth + 1)
            end if
            if (allocated(error)) then
               if (index(error%message, 'cannot ') == 1) error%message = file//':'//text_of(card%line)//': *INCLUDE: ' &
                  //error%message
               return
            end if
         else
            call deck%add_card(card)
         end if
      end do
      if (depth == 1) deck%cards = deck%cards(:deck%count)
   end subroutine parse_deck

   pure subroutine add_card(self, card)
      class(deck_t), intent(inout) :: self
      type(card_t), intent(in) :: card
      type(card_t), allocatable :: grown(:)
      if (self%count == size(self%cards)) then
         allocate (grown(2*self%count))
         grown(:self%count) = self%cards
         call move_alloc(grown, self%cards)
      end if
      self%count = self%count + 1
      self%cards(self%count) = card
   end subroutine add_card

   !> The line that begins at `at`: its last byte without the end of line; `at` moves on to the next.
   pure subroutine end_of_line(bytes, at, tail)
      character(len=*), intent(in) :: bytes
      integer, intent(inout) :: at
      integer, intent(out) :: tail
      integer :: length
      length = index(bytes(at:), achar(10)) - 1
      if (length < 0) length = len(bytes) - at + 1
      tail = at + length - 1
      at = tail + 2
      do while (tail >= 1)
         if (bytes(tail:tail) /= achar(13)) exit
         tail = tail - 1
      end do
   end subroutine end_of_line

   pure logical function is_comment(line)
      character(len=*), intent(in) :: line
      is_comment = .false.
      if (len(line) >= 2) is_comment = line(1:2) == '**'
   end function is_comment

   pure logical function ends_with_comma(text)
      character(len=*), intent(in) :: text
      integer :: n
      n = len_trim(text)
      ends_with_comma = .false.
      if (n > 0) ends_with_comma = text(n:n) == ','
   end function ends_with_comma

   !> Keyword and parameters of a line without its *.
   pure subroutine read_header(header, card)
      character(len=*), intent(in) :: header
      type(card_t), intent(inout) :: card
      type(word_t), allocatable :: parts(:)
      integer :: i, equals, n
      call split(header, parts, n)
      card%keyword = ''
      if (n > 0) card%keyword = capitals(parts(1)%text)
      allocate (card%names(max(0, n - 1)), card%values(max(0, n - 1)))
      do i = 2, n
         equals = index(parts(i)%text, '=')
         if (equals == 0) equals = len(parts(i)%text) + 1
         card%names(i - 1)%text = capitals(trim(parts(i)%text(:equals - 1)))
         card%values(i - 1)%text = ''
         if (equals < len(parts(i)%text)) card%values(i - 1)%text = without_quotes(trim(adjustl(parts(i)%text(equals + 1:))))
      end do
   end subroutine read_header

   !> Fields between commas, without blanks around them; a comma at the end begins none.
   pure subroutine split(line, parts, n)
      character(len=*), intent(in) :: line
      type(word_t), allocatable, intent(inout) :: parts(:)
      integer, intent(out) :: n
      type(word_t), allocatable :: grown(:)
      integer :: begin, comma, finish, start
      if (.not. allocated(parts)) allocate (parts(16))
      n = 0
      begin = 1
      do while (begin <= len(line))
         comma = index(line(begin:), ',')
         finish = begin + comma - 2
         if (comma == 0) finish = len(line)
         start = begin
         begin = finish + 2
         do while (start <= finish)
            if (.not. is_blank(line(start:start))) exit
            start = start + 1
         end do
         do while (finish >= start)
            if (.not. is_blank(line(finish:finish))) exit
            finish = finish - 1
         end do
         if (comma == 0 .and. finish < start) exit
         if (n == size(parts)) then
            allocate (grown(2*n))
            grown(:n) = parts
            call move_alloc(grown, parts)
         end if
         n = n + 1
         parts(n)%text = line(start:finish)
      end do
   end subroutine split

   pure function capitals(word) result(upper)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: upper
      integer :: i
      upper = ''
      do i = 1, len(word)
         if (is_blank(word(i:i))) then
            if (len(upper) == 0) cycle
            if (upper(len(upper):) /= ' ') upper = upper//' '
         else if (word(i:i) >= 'a' .and. word(i:i) <= 'z') then
            upper = upper//achar(iachar(word(i:i)) - 32)
         else
            upper = upper//word(i:i)
         end if
      end do
   end function capitals

   pure function without_quotes(word) result(text)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: text
      text = word
      if (len(text) >= 2) then
         if (text(1:1) == '"' .and. text(len(text):) == '"') text = text(2:len(text) - 1)
      end if
   end function without_quotes

   !> Whether a card has a parameter.
   pure logical function has(self, name)
      class(card_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: i
      has = .false.
      do i = 1, size(self%names)
         has = has .or. self%names(i)%text == name
      end do
   end function has

   !> The value of a parameter; '': there is none.
   pure function value(self, name) result(text)
      class(card_t), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(self%names)
         if (self%names(i)%text == name) text = self%values(i)%text
      end do
   end function value

   !> Begin to read the data of a card.
   pure subroutine start(self, card, reader)
      class(deck_t), intent(in) :: self
      integer, intent(in) :: card
      type(data_t), intent(inout) :: reader
      reader%card = card
      reader%at = self%cards(card)%first
      reader%line = self%cards(card)%data_line - 1
      reader%fields = 0
   end subroutine start

   !> Read the next line with something in it; false: there is none.
   logical function next(self, reader)
      class(deck_t), intent(in) :: self
      type(data_t), intent(inout) :: reader
      integer :: begin, tail
      next = .false.
      associate (card => self%cards(reader%card))
         if (card%data_line == 0) return
         associate (bytes => self%sources(card%source)%bytes)
            do while (reader%at <= card%last)
               begin = reader%at
               call end_of_line(bytes, reader%at, tail)
               reader%line = reader%line + 1
               if (is_comment(bytes(begin:tail))) cycle
               call split(bytes(begin:tail), reader%field, reader%fields)
               if (reader%fields == 0) cycle
               reader%goes_on = ends_with_comma(bytes(begin:tail))
               next = .true.
               return
            end do
         end associate
      end associate
   end function next

   !> Field i of the line as a number; a missing one is 0. False `ok`: it is no number.
   pure subroutine number(self, i, x, ok)
      class(data_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(out) :: x
      logical, intent(out) :: ok
      x = 0
      ok = .true.
      if (i > self%fields) return
      if (self%field(i)%text == '') return
      call parse_real(self%field(i)%text, x, ok)
   end subroutine number

   !> Field i of the line as an integer. False `ok`: it is none.
   pure subroutine whole(self, i, n, ok)
      class(data_t), intent(in) :: self
      integer, intent(in) :: i
      integer(i8), intent(out) :: n
      logical, intent(out) :: ok
      n = 0
      ok = .false.
      if (i <= self%fields) call parse_integer(self%field(i)%text, n, ok)
   end subroutine whole

   !> Raise an error with file and line: that of the data, or of the keyword.
   subroutine complain(self, card, message, error, line)
      class(deck_t), intent(in) :: self
      integer, intent(in) :: card
      character(len=*), intent(in) :: message
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: line
      integer :: at
      if (allocated(error)) return
      at = self%cards(card)%line
      if (present(line)) at = line
      call raise(error, status_input_error, self%sources(self%cards(card)%source)%file//':'//text_of(at)//': ' &
         //'*'//self%cards(card)%keyword//': '//message)
   end subroutine complain
end module finshell_deck
