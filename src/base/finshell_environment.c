/* The floating-point environment, for finshell_environment.F90: what Fortran itself does at a hundred times the cost.
 *
 * On x86-64 the library computes with SSE and AVX only, whose flags and traps are one register. Elsewhere C99's functions do it. Names like
 * those of the module's own procedures, so that the static library shows no others.
 */
#include <fenv.h>
#include <stdint.h>

#if defined(__x86_64__) && defined(__GNUC__)

/* Lower the flags and mask the traps (bits 0 to 5 and 7 to 12). */
void __finshell_environment_MOD_c_hold(uint32_t *store)
{
   uint32_t mine;
   __asm__ volatile("stmxcsr %0" : "=m"(*store));
   mine = (*store & ~0x3fu) | 0x1f80u;
   __asm__ volatile("ldmxcsr %0" : : "m"(mine));
}

void __finshell_environment_MOD_c_release(const uint32_t *store)
{
   __asm__ volatile("ldmxcsr %0" : : "m"(*store));
}

/* Whether something was invalid, infinite or too large since. */
int __finshell_environment_MOD_c_flags(void)
{
   uint32_t now;
   __asm__ volatile("stmxcsr %0" : "=m"(now));
   return (now & 0x0d) != 0;
}

#else

void __finshell_environment_MOD_c_hold(fenv_t *store)
{
   feholdexcept(store);
}

void __finshell_environment_MOD_c_release(const fenv_t *store)
{
   fesetenv(store);
}

int __finshell_environment_MOD_c_flags(void)
{
   return fetestexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW) != 0;
}

#endif
