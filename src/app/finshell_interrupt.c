/* Ctrl-C and SIGTERM for finshell_interrupt.f90: the first one is noted, the second one ends the program as if nobody had asked. */
#define _POSIX_C_SOURCE 200809L
#include <signal.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

static volatile sig_atomic_t asked, speaks;

static void note(int number)
{
   static const char text[] = "\nfinshell: stops after this increment; once more: at once\n";
   if (asked) {
      signal(number, SIG_DFL);
      raise(number); /* delivered when this returns */
      return;
   }
   asked = 1;
   if (speaks && write(2, text, sizeof text - 1) < 0)
      return; /* nobody listens */
}

static void watch(int number)
{
   struct sigaction before, action;
   if (sigaction(number, NULL, &before) != 0 || before.sa_handler == SIG_IGN)
      return; /* whoever started this program does not want it to be stopped (nohup) */
   memset(&action, 0, sizeof action);
   action.sa_handler = note;
   action.sa_flags = SA_RESTART;
   sigemptyset(&action.sa_mask);
   sigaction(number, &action, NULL);
}

/* From now on signals are noted; with `aloud` a sentence tells that. */
void finshell_interrupt_watch(int aloud)
{
   speaks = aloud;
   watch(SIGINT);
   watch(SIGTERM);
}

int finshell_interrupt_asked(void)
{
   return asked;
}
