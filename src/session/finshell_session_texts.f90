!> What a session can tell about itself in words.
module finshell_session_texts
   use finshell_error, only: error_t, raise
   use finshell_field, only: name_t
   use finshell_result_fields, only: result_field_t, result_fields
   use finshell_session, only: session_t
   use finshell_status, only: status_input_error
   implicit none
   private
   public :: text_about

   character(len=*), parameter :: newline = new_line('a')

contains

   !> Errors: a question that is not known.
   subroutine text_about(session, what, answer, error)
      type(session_t), intent(in) :: session
      character(len=*), intent(in) :: what
      character(len=:), allocatable, intent(out) :: answer
      type(error_t), allocatable, intent(out) :: error
      type(result_field_t), allocatable :: table(:)
      type(name_t), allocatable :: names(:)
      integer :: i
      answer = ''
      associate (mesh => session%input%structure%mesh)
         select case (what)
         case ('title'); answer = session%input%title
         case ('name'); answer = session%input%name
         case ('file'); answer = session%input%file
         case ('warnings'); answer = session%warnings
         case ('node_sets')
            do i = 1, size(mesh%node_sets)
               call add(mesh%node_sets(i)%name)
            end do
         case ('element_sets')
            do i = 1, size(mesh%element_sets)
               call add(mesh%element_sets(i)%name)
            end do
         case ('edge_sets')
            do i = 1, size(mesh%edge_sets)
               call add(mesh%edge_sets(i)%name)
            end do
         case ('columns')
            names = session%bell%columns()
            do i = 1, size(names)
               call add(names(i)%text)
            end do
         case ('steps')
            do i = 1, size(session%input%steps)
               call add(session%step_name(i))
            end do
         case ('fields')
            table = result_fields()
            do i = 1, size(table)
               call add(trim(table(i)%name))
            end do
         case default
            call raise(error, status_input_error, "there is no text '"//what//"'; there are: title, name, file, warnings, " &
                       //'node_sets, element_sets, edge_sets, columns, steps, fields')
         end select
      end associate

   contains

      subroutine add(line)
         character(len=*), intent(in) :: line
         if (len(answer) > 0) answer = answer//newline
         answer = answer//line
      end subroutine add
   end subroutine text_about
end module finshell_session_texts
