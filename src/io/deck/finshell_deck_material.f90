!> Materials and sections of a deck as groups of a namelist.
module finshell_deck_material
   use finshell_deck, only: data_t, deck_t
   use finshell_deck_writer, only: number_text, quoted, vector_text, writer_t
   use finshell_kinds, only: i8, wp
   use finshell_rotation, only: cross_product
   use finshell_text, only: lower_case, parse_integer, parse_real
   implicit none
   private
   public :: convert_material, convert_section

   integer, parameter :: most = 32 !< numbers of a material
   character, parameter :: lf = achar(10)

contains

   !> The cards from *MATERIAL at `first` to the last that is a part of it.
   subroutine convert_material(deck, first, last, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: first
      integer, intent(out) :: last
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: law, density
      real(wp) :: x(most)
      integer :: c, n
      law = ''
      density = ''
      do c = first + 1, size(deck%cards)
         select case (deck%cards(c)%keyword)
         case ('DENSITY')
            call numbers(deck, c, writer, x, n)
            if (n > 0) density = ' density = '//number_text(x(1))
         case ('ELASTIC'); call elastic(deck, c, writer, law)
         case ('HYPERELASTIC'); call hyperelastic(deck, c, writer, law)
         case ('EXPANSION'); call expansion(deck, c, lower_case(deck%cards(first)%value('NAME')), writer)
         case ('PLASTIC', 'DAMPING', 'VISCOELASTIC', 'CONDUCTIVITY', 'SPECIFIC HEAT', 'HYPERFOAM', 'USER MATERIAL', &
               'DEPVAR', 'CREEP', 'MULLINS EFFECT', 'UNIAXIAL TEST DATA', 'BIAXIAL TEST DATA', 'PLANAR TEST DATA', &
               'ANISOTROPIC HYPERELASTIC')
            call writer%miss(deck, c, '')
         case default; exit
         end select
      end do
      last = c - 1
      if (law == '') then
         call writer%miss(deck, first, 'the material '//quoted(deck%cards(first)%value('NAME'))//' has no law that is known')
      else
         writer%materials = writer%materials//'&material name = '//quoted(lower_case(deck%cards(first)%value('NAME')))//law &
            //density//' /'//lf
      end if
   end subroutine convert_material

   subroutine elastic(deck, c, writer, law)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable, intent(inout) :: law
      real(wp) :: x(most)
      integer :: n
      call numbers(deck, c, writer, x, n)
      select case (lower_case(deck%cards(c)%value('TYPE')))
      case ('', 'isotropic', 'iso')
         if (n >= 2) law = " law = 'linear_elastic' e = "//number_text(x(1))//' nu = '//number_text(x(2))
      case ('lamina')
         if (n >= 4) law = " law = 'orthotropic' e1 = "//number_text(x(1))//' e2 = '//number_text(x(2))//' nu12 = ' &
            //number_text(x(3))//' g12 = '//number_text(x(4))
      case ('engineering constants')
         if (n >= 7) law = " law = 'orthotropic' e1 = "//number_text(x(1))//' e2 = '//number_text(x(2))//' nu12 = ' &
            //number_text(x(4))//' nu13 = '//number_text(x(5))//' nu23 = '//number_text(x(6))//' g12 = '//number_text(x(7))
      case default
         call writer%miss(deck, c, 'TYPE = '//deck%cards(c)%value('TYPE'))
      end select
   end subroutine elastic

   !> Coefficients of thermal expansion: one, or those along the axes of the material.
   subroutine expansion(deck, c, material, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      character(len=*), intent(in) :: material
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: text
      real(wp) :: x(most)
      integer :: i, n, needed
      select case (lower_case(deck%cards(c)%value('TYPE')))
      case ('', 'iso', 'isotropic'); needed = 1
      case ('ortho', 'orthotropic'); needed = 3
      case default; needed = most + 1
      end select
      call numbers(deck, c, writer, x, n)
      if (n < needed) then
         call writer%miss(deck, c, 'one coefficient, or three with TYPE = ORTHO, are expected')
         return
      end if
      text = ''
      do i = 1, needed
         text = text//' '//number_text(x(i))
      end do
      call writer%add_expansion(material, text)
   end subroutine expansion

   !> Incompressible laws; Abaqus' Ogden law has 2 mu/alpha^2 where ours has mu/alpha.
   subroutine hyperelastic(deck, c, writer, law)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable, intent(inout) :: law
      integer(i8) :: terms
      real(wp) :: x(most)
      integer :: i, n, used
      logical :: ok

      call numbers(deck, c, writer, x, n)
      used = 0
      associate (card => deck%cards(c))
         if (card%has('NEO HOOKE') .and. n >= 1) then
            law = " law = 'neo_hookean' mu = "//number_text(2*x(1))
            used = 1
         else if (card%has('MOONEY-RIVLIN') .and. n >= 2) then
            law = " law = 'mooney_rivlin' c10 = "//number_text(x(1))//' c01 = '//number_text(x(2))
            used = 2
         else if (card%has('YEOH') .and. n >= 3) then
            law = " law = 'yeoh' c1 = "//number_text(x(1))//' c2 = '//number_text(x(2))//' c3 = '//number_text(x(3))
            used = 3
         else if (card%has('OGDEN')) then
            call parse_integer(card%value('N'), terms, ok)
            if (.not. ok) terms = 1
            if (terms >= 1 .and. terms <= 6 .and. n >= 2*terms) then
               if (all(abs(x(2:2*terms:2)) > 0)) then
                  law = " law = 'ogden'"
                  do i = 1, int(terms)
                     law = law//' mu'//achar(48 + i)//' = '//number_text(2*x(2*i - 1)/x(2*i))//' alpha'//achar(48 + i)//' = ' &
                        //number_text(x(2*i))
                  end do
                  used = 2*int(terms)
               end if
            end if
         end if
      end associate
      if (used == 0) then
         call writer%miss(deck, c, 'this form is not known')
      else if (any(abs(x(used + 1:n)) > 0)) then
         call writer%miss(deck, c, 'compressibility (D1, ...): the law is incompressible here')
      end if
   end subroutine hyperelastic

   !> The numbers of the data; with several temperatures those of the first.
   subroutine numbers(deck, c, writer, x, n)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      real(wp), intent(out) :: x(most)
      integer, intent(out) :: n
      type(data_t) :: line
      integer :: i
      logical :: full, ok
      x = 0
      n = 0
      full = .false.
      call deck%start(c, line)
      do while (deck%next(line))
         if (full) then
            call writer%miss(deck, c, 'more than one line of data (temperatures?)', line%line)
            return
         end if
         do i = 1, min(line%fields, most - n)
            call line%number(i, x(n + i), ok)
            if (.not. ok) call writer%miss(deck, c, "'"//line%field(i)%text//"' is no number", line%line)
         end do
         n = min(most, n + line%fields)
         full = line%fields < 8 ! a card of eight numbers goes on in the next line
      end do
   end subroutine numbers

   !> *SHELL SECTION, *MEMBRANE SECTION, *SOLID SECTION of plane elements.
   subroutine convert_section(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: angles, group, materials, set, thicknesses
      real(wp) :: angle, offset, thickness, whole
      integer :: layers
      logical :: ok, shell

      layers = 0
      shell = deck%cards(c)%keyword == 'SHELL SECTION'
      set = writer%element_set(deck%cards(c)%value('ELSET'))
      if (set == '') return ! of elements that were left out
      thicknesses = ''
      materials = ''
      angles = ''
      whole = 0
      call deck%start(c, line)
      do while (deck%next(line))
         call line%number(1, thickness, ok)
         if (.not. ok) call writer%miss(deck, c, "'"//line%field(1)%text//"' is no thickness", line%line)
         thicknesses = thicknesses//' '//number_text(thickness)
         whole = whole + thickness
         if (.not. deck%cards(c)%has('COMPOSITE')) exit
         if (line%fields < 3) call writer%miss(deck, c, 'a layer without a material', line%line)
         if (line%fields >= 3) then
            materials = materials//' '//quoted(lower_case(line%field(3)%text))
            layers = layers + 1
            call writer%add_ply(set, lower_case(line%field(3)%text), layers)
         end if
         angle = 0
         if (line%fields >= 4) call line%number(4, angle, ok)
         if (.not. ok) call writer%miss(deck, c, "orientation '"//line%field(4)%text//"' of a layer: an angle is expected", &
                                        line%line)
         angles = angles//' '//number_text(angle)
      end do
      if (materials == '') then
         materials = ' '//quoted(lower_case(deck%cards(c)%value('MATERIAL')))
         call writer%add_ply(set, lower_case(deck%cards(c)%value('MATERIAL')), 0)
      end if
      if (thicknesses == '') then
         thicknesses = ' 1.0'
         if (shell) call writer%miss(deck, c, 'it has no thickness; 1.0 is taken')
      end if
      group = '&section element_set = '//quoted(set)//' material ='//materials//' thickness ='//thicknesses
      if (deck%cards(c)%keyword == 'MEMBRANE SECTION') group = group//" type = 'membrane'"
      if (deck%cards(c)%has('ORIENTATION')) call orientation(deck, c, writer, group, angles)
      if (angles /= '') group = group//' angle ='//angles
      offset = 0
      select case (lower_case(deck%cards(c)%value('OFFSET')))
      case (''); continue
      case ('spos'); offset = 0.5_wp
      case ('sneg'); offset = -0.5_wp
      case default
         call parse_real(deck%cards(c)%value('OFFSET'), offset, ok)
         if (.not. ok) call writer%miss(deck, c, 'OFFSET = '//deck%cards(c)%value('OFFSET'))
      end select
      if (abs(offset) > 0) group = group//' offset = '//number_text(-offset*whole)
      writer%sections = writer%sections//group//' /'//lf
   end subroutine convert_section

   !> Material direction 1 by *ORIENTATION: of its axes the one behind the axis that is nearest to the normal, which the card names.
   subroutine orientation(deck, c, writer, group, angles)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable, intent(inout) :: group, angles
      type(data_t) :: line
      character(len=:), allocatable :: name
      real(wp) :: a(3), angle, axes(3, 3), b(3)
      integer(i8) :: n
      integer :: d, k, which
      logical :: ok, fine

      name = lower_case(deck%cards(c)%value('ORIENTATION'))
      do d = 1, size(deck%cards)
         if (deck%cards(d)%keyword == 'ORIENTATION' .and. lower_case(deck%cards(d)%value('NAME')) == name) exit
      end do
      if (d > size(deck%cards)) then
         call writer%miss(deck, c, "there is no *ORIENTATION '"//name//"'")
         return
      end if
      call deck%start(d, line)
      ok = deck%next(line)
      a = 0
      b = 0
      do k = 1, 3
         if (ok) call line%number(k, a(k), ok)
         if (ok) call line%number(3 + k, b(k), ok)
      end do
      n = 1
      angle = 0
      if (deck%next(line)) then
         call line%whole(1, n, fine)
         call line%number(2, angle, ok)
         ok = ok .and. fine .and. n >= 1 .and. n <= 3
      end if
      if (.not. ok .or. deck%cards(d)%has('DEFINITION')) then
         call writer%miss(deck, d, 'this form of the data is not known')
         return
      end if
      select case (lower_case(deck%cards(d)%value('SYSTEM')))
      case ('', 'rectangular', 'r')
         axes(:, 1) = a/max(norm2(a), tiny(a))
         axes(:, 3) = cross_product(a, b)
         axes(:, 3) = axes(:, 3)/max(norm2(axes(:, 3)), tiny(a))
         axes(:, 2) = cross_product(axes(:, 3), axes(:, 1))
         which = 1 + mod(int(n), 3)
         group = group//' direction = '//vector_text(axes(:, which))
      case ('cylindrical', 'c')
         if (n == 1) group = group//" direction_field = 'circumferential'"
         if (n == 2) group = group//" direction_field = 'axial'"
         if (n == 3) group = group//" direction_field = 'radial'"
         group = group//' direction_axis = '//vector_text(b - a)//' direction_origin = '//vector_text(a)
      case default
         call writer%miss(deck, d, 'SYSTEM = '//deck%cards(d)%value('SYSTEM'))
         return
      end select
      if (abs(angle) > 0) then
         if (angles /= '') call writer%miss(deck, d, 'an additional angle of a composite')
         if (angles == '') angles = ' '//number_text(angle)
      end if
   end subroutine orientation
end module finshell_deck_material
