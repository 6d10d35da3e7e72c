/* Preloaded into a program: kills it at its KILL_AT-th write to an HDF5 file; with KILL_AT=0 prints how many there were. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/types.h>

static long count, last;
static ssize_t (*real)(int, const void *, size_t, off_t);

ssize_t pwrite(int file, const void *bytes, size_t n, off_t place) {
  if (!real) {
    real = (ssize_t(*)(int, const void *, size_t, off_t))dlsym(RTLD_NEXT, "pwrite");
    last = atol(getenv("KILL_AT"));
  }
  if (++count == last) raise(SIGKILL);
  return real(file, bytes, n, place);
}

__attribute__((destructor)) static void done(void) {
  if (last == 0) fprintf(stderr, "%ld\n", count);
}
