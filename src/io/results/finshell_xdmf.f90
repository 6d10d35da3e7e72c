!> XDMF file beside a VTKHDF file, for readers that do not know VTKHDF: every step points into the same datasets.
!>
!> The end of the document is rewritten with every step, so that the file is complete at any time.
module finshell_xdmf
   use finshell_disk, only: cut_in_system, length_in_system, rename_in_system
   use finshell_error, only: error_t, raise, text_of
   use finshell_field, only: field_t, increment_t
   use finshell_kinds, only: i8, wp
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: xdmf_file_t, xdmf_name

   character(len=*), parameter :: nl = new_line('a')
   character(len=*), parameter :: tail = '  </Grid>'//nl//' </Domain>'//nl//'</Xdmf>'//nl

   type :: xdmf_file_t
      private
      integer :: unit = -1
      integer(i8) :: position = 1 !< where the next step goes
      character(len=:), allocatable :: name, source
      integer :: nodes = 0, elements = 0
   contains
      procedure :: create
      procedure :: publish
      procedure :: append
      procedure :: close => close_file
      procedure, private :: put
   end type xdmf_file_t

contains

   !> Create the file; `hdf5_name` is the VTKHDF file beside it (later, if files are renamed).
   subroutine create(self, name, hdf5_name, nodes, elements, error)
      class(xdmf_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name, hdf5_name
      integer, intent(in) :: nodes, elements
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: status
      self%name = name
      self%source = escaped(hdf5_name(index(hdf5_name, '/', back=.true.) + 1:))
      self%nodes = nodes
      self%elements = elements
      self%position = 1
      open (newunit=self%unit, file=name, status='replace', action='write', form='unformatted', access='stream', &
         & iostat=status, iomsg=reason)
      if (status /= 0) then
         self%unit = -1
         call raise(error, status_io_error, name//': cannot create the XDMF file: '//trim(reason))
         return
      end if
      call self%put('<?xml version="1.0"?>'//nl//'<Xdmf Version="2.0">'//nl//' <Domain>'//nl &
         & //'  <Grid Name="finshell" GridType="Collection" CollectionType="Temporal">'//nl, error)
   end subroutine create

   !> Rename the file, replacing another one of that name.
   subroutine publish(self, name, error)
      class(xdmf_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      if (rename_in_system(self%name, name)) then
         self%name = name
      else
         call raise(error, status_io_error, name//': cannot give the XDMF file its name')
      end if
   end subroutine publish

   !> Describe step `step` (counted from 0) of the VTKHDF file.
   subroutine append(self, step, record, time, point_fields, cell_fields, point_bytes, cell_bytes, error)
      class(xdmf_file_t), intent(inout) :: self
      integer, intent(in) :: step
      type(increment_t), intent(in) :: record
      real(wp), intent(in) :: time !< of the step
      type(field_t), intent(in) :: point_fields(:), cell_fields(:)
      integer, intent(in) :: point_bytes(:), cell_bytes(:) !< of a number of each field
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      integer :: i
      text = '   <Grid Name="increment '//text_of(record%increment)//'">'//nl &
         & //'    <Time Value="'//time_text(time)//'"/>'//nl &
         & //'    <Information Name="load_factor" Value="'//text_of(record%load_factor)//'"/>'//nl &
         & //'    <Topology TopologyType="Triangle" NumberOfElements="'//text_of(self%elements)//'">'//nl &
         & //'     <DataItem Format="HDF" NumberType="Int" Precision="8" Dimensions="'//text_of(self%elements)//' 3">' &
         & //self%source//':/VTKHDF/Connectivity</DataItem>'//nl//'    </Topology>'//nl &
         & //'    <Geometry GeometryType="XYZ">'//nl &
         & //'     <DataItem Format="HDF" NumberType="Float" Precision="8" Dimensions="'//text_of(self%nodes)//' 3">' &
         & //self%source//':/VTKHDF/Points</DataItem>'//nl//'    </Geometry>'//nl
      do i = 1, size(point_fields)
         text = text//attribute(self%source, point_fields(i), 'Node', 'PointData', self%nodes, step, point_bytes(i))
      end do
      do i = 1, size(cell_fields)
         text = text//attribute(self%source, cell_fields(i), 'Cell', 'CellData', self%elements, step, cell_bytes(i))
      end do
      call self%put(text//'   </Grid>'//nl, error)
   end subroutine append

   subroutine close_file(self)
      class(xdmf_file_t), intent(inout) :: self
      integer :: ignored
      ! allow(C181)
      if (self%unit /= -1) close (self%unit, iostat=ignored)
      self%unit = -1
   end subroutine close_file

   !> NAME.xdmf for NAME.vtkhdf.
   pure function xdmf_name(file_name) result(name)
      character(len=*), intent(in) :: file_name
      character(len=:), allocatable :: name
      integer :: dot
      dot = index(file_name, '.', back=.true.)
      if (dot <= index(file_name, '/', back=.true.)) dot = len(file_name) + 1
      name = file_name(:dot - 1)//'.xdmf'
   end function xdmf_name

   !> One field at one step: the rows step * items ... of its dataset.
   function attribute(source, field, center, group, items, step, bytes) result(text)
      character(len=*), intent(in) :: source, center, group
      type(field_t), intent(in) :: field
      integer, intent(in) :: items, step, bytes
      character(len=:), allocatable :: text
      character(len=:), allocatable :: columns, one, zero, all, kind
      ! a scalar field is a list in the file: its selection has one dimension, not two
      columns = ''
      zero = ''
      one = ''
      if (field%components > 1) then
         columns = ' '//text_of(field%components)
         zero = ' 0'
         one = ' 1'
      end if
      kind = 'Matrix'
      if (field%components == 1) kind = 'Scalar'
      if (field%components == 3) kind = 'Vector'
      all = text_of((step + 1_i8) * items)
      text = '    <Attribute Name="'//field%name//'" AttributeType="'//kind//'" Center="'//center//'">'//nl &
         & //'     <DataItem ItemType="HyperSlab" Dimensions="'//text_of(items)//columns//'">'//nl &
         & //'      <DataItem Format="XML" NumberType="Int" Precision="8" Dimensions="3 '//trim(merge('2', '1', one /= '')) &
         & //'">'//text_of(int(step, i8) * items)//zero//'  1'//one//'  '//text_of(items)//columns//'</DataItem>'//nl &
         & //'      <DataItem Format="HDF" NumberType="Float" Precision="'//text_of(bytes)//'" Dimensions="'//all//columns//'">' &
         & //source//':/VTKHDF/'//group//'/'//field%name//'</DataItem>'//nl &
         & //'     </DataItem>'//nl//'    </Attribute>'//nl
   end function attribute

   !> Write `text` over the end of the document, and a new end after it, in one piece.
   subroutine put(self, text, error)
      class(xdmf_file_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: status
      write (self%unit, pos=self%position, iostat=status, iomsg=reason) text//tail
      if (status == 0) flush (self%unit, iostat=status, iomsg=reason)
      if (status == 0) status = merge(0, 1, length_in_system(self%name) >= self%position - 1 + len(text//tail))
      if (status == 1) reason = 'the disk is full, or the file larger than allowed (ulimit -f)' ! gfortran does not tell
      if (status /= 0) then
         call raise(error, status_io_error, self%name//': cannot write the XDMF file: '//trim(reason))
         ! the old end takes no room that was not there before
         call self%close()
         open (newunit=self%unit, file=self%name, status='old', action='write', form='unformatted', access='stream', iostat=status)
         if (status == 0) write (self%unit, pos=self%position, iostat=status) tail
         if (status /= 0) error%message = error%message//'; it is damaged'
         call self%close()
         call cut_in_system(self%name, self%position - 1 + len(tail))
         return
      end if
      self%position = self%position + len(text)
   end subroutine put

   !> Text with the characters replaced that mean something to XML.
   pure function escaped(text) result(safe)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: safe
      integer :: i
      safe = ''
      do i = 1, len(text)
         select case (text(i:i))
         case ('&'); safe = safe//'&amp;'
         case ('<'); safe = safe//'&lt;'
         case ('>'); safe = safe//'&gt;'
         case ('"'); safe = safe//'&quot;'
         case default; safe = safe//text(i:i)
         end select
      end do
   end function escaped

   !> A time, as a number of increments where it is one.
   pure function time_text(time) result(text)
      real(wp), intent(in) :: time
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      if (time >= 0 .and. time < 1.0e9_wp .and. .not. abs(time - anint(time)) > 0) then
         text = text_of(nint(time))
      else
         write (buffer, '(es25.16e3)') time
         text = trim(adjustl(buffer))
      end if
   end function time_text
end module finshell_xdmf
