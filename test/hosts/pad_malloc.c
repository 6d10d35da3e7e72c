/* Preloaded under OOFEM's AbaqusUserElement, which writes the coordinates of the third node behind the end of its array. */
#include <stddef.h>

void *__libc_malloc(size_t size);

void *malloc(size_t size) {
   return __libc_malloc(size + 64);
}
