/* Processes for finshell_process.f90: this program again, with other arguments. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

extern char **environ;

/* Start a program; arguments stand one after the other, each with its zero. All that it says goes to a file. Its number, or -1. */
int finshell_process_start(const char *program, int count, const char *arguments, const char *output)
{
   char **list = calloc((size_t)count + 2, sizeof *list);
   posix_spawn_file_actions_t actions;
   posix_spawnattr_t attributes;
   pid_t pid = -1;
   if (list == NULL)
      return -1;
   list[0] = (char *)program;
   for (int i = 0; i < count; i++) {
      list[i + 1] = (char *)arguments;
      arguments += strlen(arguments) + 1;
   }
   if (posix_spawn_file_actions_init(&actions) == 0 && posix_spawnattr_init(&attributes) == 0) {
      /* a group of its own: Ctrl-C is for the program that started it, which tells its children */
      posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
      posix_spawnattr_setpgroup(&attributes, 0);
      posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
      posix_spawn_file_actions_addopen(&actions, 1, output, O_WRONLY | O_CREAT | O_TRUNC, 0666);
      posix_spawn_file_actions_adddup2(&actions, 1, 2);
      if (posix_spawn(&pid, "/proc/self/exe", &actions, &attributes, list, environ) != 0 &&
          posix_spawnp(&pid, program, &actions, &attributes, list, environ) != 0)
         pid = -1;
      posix_spawnattr_destroy(&attributes);
      posix_spawn_file_actions_destroy(&actions);
   }
   free(list);
   return pid;
}

/* Has it ended? 1: yes, with its exit code (128 and a signal if that ended it) and seconds of processor time; 0: not yet; -1: no such. */
int finshell_process_ended(int pid, int *code, double *seconds)
{
   struct rusage used;
   int status;
   pid_t found = wait4(pid, &status, WNOHANG, &used);
   if (found == 0 || (found < 0 && errno == EINTR))
      return 0;
   if (found < 0)
      return -1;
   *code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
   *seconds = (double)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + 1e-6 * (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
   return 1;
}

/* End when the process that started this one ends, whatever ends it. */
void finshell_process_end_with_parent(void)
{
#ifdef __linux__
   prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
}

void finshell_process_kill(int pid)
{
   kill(pid, SIGKILL);
}

/* What Ctrl-C does. */
void finshell_process_interrupt(int pid)
{
   kill(pid, SIGINT);
}

/* Wait for some milliseconds. */
void finshell_process_rest(int milliseconds)
{
   struct timespec time = {milliseconds / 1000, (milliseconds % 1000) * 1000000L};
   nanosleep(&time, NULL);
}

/* Make a folder; 0 where it is there afterwards. */
int finshell_make_folder(const char *name)
{
   struct stat found;
   if (mkdir(name, 0777) == 0)
      return 0;
   return stat(name, &found) == 0 && S_ISDIR(found.st_mode) ? 0 : 1;
}
