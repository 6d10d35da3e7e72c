/* The procedures of the kernel that others call: each jumps to the copy that was compiled for this processor.
 *
 * functions.inc and the copies NAME__1 (x86-64), NAME__3 (x86-64-v3: AVX2, FMA), NAME__4 (x86-64-v4: AVX-512) come from
 * merge.cmake. The choice is made when program or library are loaded and never changes. The environment variable
 * FINSHELL_CPU_LEVEL (1, 3 or 4) lowers it.
 */
#include <stdlib.h>

/* 16 bytes of code each: a jump through the table. Arguments, stack and return address stay as they are. */
#define FUNCTION(number, name)                                                                                                    \
   void name##__1(void);                                                                                                          \
   void name##__3(void);                                                                                                          \
   void name##__4(void);                                                                                                          \
   __asm__(".pushsection .text\n.balign 16\n.globl " #name "\n.type " #name ", @function\n" #name ":\n"                           \
           "jmp *__finshell_dispatch_MOD_table+8*" #number "(%rip)\n.size " #name ", .-" #name "\n.popsection\n");
#include "functions.inc"
#undef FUNCTION

typedef void (*procedure)(void);

#define FUNCTION(number, name) name##__1,
extern procedure __finshell_dispatch_MOD_table[];
__attribute__((visibility("hidden"), used)) procedure __finshell_dispatch_MOD_table[] = {
#include "functions.inc"
};
#undef FUNCTION

#define FUNCTION(number, name) name##__3,
static procedure const level_3[] = {
#include "functions.inc"
};
#undef FUNCTION

#define FUNCTION(number, name) name##__4,
static procedure const level_4[] = {
#include "functions.inc"
};
#undef FUNCTION

/* Before the constructors of others, which may call us already; until then the table is that of every processor. */
__attribute__((constructor(101))) static void choose(void)
{
   const char *wanted = getenv("FINSHELL_CPU_LEVEL");
   const procedure *chosen = NULL;
   int highest = 4;
   if (wanted != NULL && (wanted[0] == '1' || wanted[0] == '3') && wanted[1] == '\0') highest = wanted[0] - '0';
   __builtin_cpu_init();
   if (highest >= 3 && __builtin_cpu_supports("x86-64-v3")) chosen = level_3;
   if (highest >= 4 && __builtin_cpu_supports("x86-64-v4")) chosen = level_4;
   if (chosen == NULL) return;
   for (size_t i = 0; i < sizeof level_3 / sizeof *level_3; i++) __finshell_dispatch_MOD_table[i] = chosen[i];
}
