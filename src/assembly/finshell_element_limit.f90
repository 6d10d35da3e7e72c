!> Why an element cannot be evaluated, for messages: what has ended, of which law, and how far the element was stretched.
module finshell_element_limit
   use finshell_element_failure, only: rotation_failure
   use finshell_error, only: text_of
   use finshell_kinds, only: wp, dp, i4
   use finshell_state, only: state_t
   use finshell_status, only: status_collapsed_element, status_material_limit, status_large_rotation, status_text
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: element_trouble, law_limit

contains

   !> One sentence for an element with a status other than ok.
   function element_trouble(structure, element, status, base, state) result(text)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: element
      integer(i4), intent(in) :: status
      type(state_t), intent(in) :: base !< the last equilibrium state
      type(state_t), intent(in) :: state !< where the element failed
      character(len=:), allocatable :: text
      text = 'element '//text_of(element)//': '
      select case (status)
      case (status_material_limit)
         text = text//laws_of(structure, element)//'; its principal stretches were '//stretches(structure, element, base) &
            //' at the last equilibrium'
      case (status_collapsed_element)
         text = text//'its area becomes zero; its principal stretches were '//stretches(structure, element, base) &
            //' at the last equilibrium'
      case (status_large_rotation)
         text = rotation_failure(structure%mesh, state, element, status)
      case default
         text = text//status_text(status)
      end select
   end function element_trouble

   !> What ends where a law cannot be evaluated, and what else to take.
   pure function law_limit(name) result(text)
      character(len=*), intent(in) :: name !< as in finshell_registry
      character(len=:), allocatable :: text
      select case (name)
      case ('st_venant_kirchhoff', 'linear_elastic', 'orthotropic')
         text = 'its thickness reaches zero, as it is linear in the Green-Lagrange strains: a law for small strains; for this ' &
            //'stretch take neo_hookean or another law of rubber'
      case ('gent')
         text = 'I1 - 3 reaches jm, where its chains are fully stretched'
      case ('ogden')
         text = 'a stretch to the power of alpha is beyond all bounds'
      case ('exponential_fibre', 'holzapfel_2005', 'holzapfel_gasser_ogden')
         text = 'the exponent of its fibres, or the compression of the surface, is beyond all bounds'
      case ('compressible_neo_hookean')
         text = 'no thickness is found for this stretch of the surface'
      case default
         text = 'the surface is pressed together to nothing, or stretched beyond all bounds'
      end select
   end function law_limit

   !> The laws of an element, each with what ends.
   function laws_of(structure, element) result(text)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: element
      character(len=:), allocatable :: text
      integer :: i, k
      text = ''
      associate (layers => structure%sections(structure%element_section(element))%layers)
         do i = 1, size(layers)
            if (any([(layers(k)%law%name == layers(i)%law%name, k=1, i - 1)])) cycle
            if (text /= '') text = text//'; or '
            text = text//'the law '//trim(layers(i)%law%name)//' ends: '//law_limit(trim(layers(i)%law%name))
         end do
      end associate
   end function laws_of

   !> Principal stretches of the surface, as text.
   function stretches(structure, element, state) result(text)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: element
      type(state_t), intent(in) :: state
      character(len=:), allocatable :: text
      real(wp) :: now(3, 2), before(3, 2), c(2, 2), f(2, 2), mean, radius
      integer :: k
      associate (nodes => structure%mesh%triangles(:, element))
         do k = 1, 2
            before(:, k) = structure%mesh%coordinates(:, nodes(k + 1)) - structure%mesh%coordinates(:, nodes(1))
            now(:, k) = before(:, k) + state%displacement(:, nodes(k + 1)) - state%displacement(:, nodes(1))
         end do
      end associate
      ! With the sides before = (a, 0), (b, h) in axes of their own, f maps these axes to combinations of the sides.
      f(1, 1) = 1/norm2(before(:, 1))
      f(2, 1) = 0
      f(1, 2) = -dot_product(before(:, 1), before(:, 2))/dot_product(before(:, 1), before(:, 1))
      f(2, 2) = 1
      f(:, 2) = f(:, 2)/norm2(before(:, 2) + f(1, 2)*before(:, 1))
      c = matmul(transpose(f), matmul(matmul(transpose(now), now), f))
      mean = (c(1, 1) + c(2, 2))/2
      radius = hypot((c(1, 1) - c(2, 2))/2, c(1, 2))
      text = text_of(real(sqrt(mean + radius), dp))//' and '//text_of(real(sqrt(max(mean - radius, 0.0_wp)), dp))
   end function stretches
end module finshell_element_limit
