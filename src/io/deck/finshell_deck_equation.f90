!> *EQUATION of a deck: a sum of displacements that is zero.
module finshell_deck_equation
   use finshell_deck, only: data_t, deck_t
   use finshell_deck_writer, only: number_text, quoted, writer_t
   use finshell_freedoms, only: uz
   use finshell_kinds, only: i8, wp
   implicit none
   private
   public :: convert_equation

   character, parameter :: lf = achar(10)
   character(len=2), parameter :: components(uz) = ['ux', 'uy', 'uz']

contains

   !> The number of terms, then node or set, degree of freedom and coefficient of each, over as many lines as it takes.
   subroutine convert_equation(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: sets, words, numbers, set, refusal
      integer(i8) :: terms, component
      integer :: field, k, at
      real(wp) :: coefficient
      logical :: ok, fine

      call deck%start(c, line)
      do while (deck%next(line))
         at = line%line
         call line%whole(1, terms, ok)
         if (.not. ok .or. terms < 2) then
            call writer%miss(deck, c, 'the number of terms, 2 or more, is expected', at)
            return
         end if
         sets = ''
         words = ''
         numbers = ''
         refusal = ''
         field = line%fields + 1
         do k = 1, int(terms)
            if (field + 2 > line%fields) then
               ok = deck%next(line)
               if (ok) ok = line%fields >= 3
               if (.not. ok) then
                  call writer%miss(deck, c, 'it ends before its last term', at)
                  return
               end if
               field = 1
            end if
            set = writer%node_set(line%field(field)%text)
            call line%whole(field + 1, component, ok)
            call line%number(field + 2, coefficient, fine)
            if (set == '') then
               refusal = "'"//line%field(field)%text//"': it has no node of a shell"
            else if (.not. (ok .and. fine)) then
               refusal = 'node, degree of freedom and coefficient are expected'
            else if (component < 1 .or. component > uz) then
               refusal = 'degrees of freedom 1 to 3 are expected: rotations do not add'
            else
               if (k > 1) then
                  sets = sets//', '
                  words = words//', '
                  numbers = numbers//', '
               end if
               sets = sets//quoted(set)
               words = words//quoted(components(component))
               numbers = numbers//number_text(coefficient)
            end if
            field = field + 3
         end do
         if (refusal /= '') then
            call writer%miss(deck, c, refusal, at)
         else
            writer%joints = writer%joints//'&equation node_set = '//sets//' components = '//words//' coefficients = '//numbers &
                              //' /'//lf
         end if
      end do
   end subroutine convert_equation
end module finshell_deck_equation
