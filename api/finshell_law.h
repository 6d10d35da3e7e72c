/* What a shared library of laws needs beside finshell.h: one function that finds them. C99 and C++.
 *
 *    static const finshell_law laws[] = {{sizeof(finshell_law), "my_law", FINSHELL_LAW_PLANE, ...}};
 *    FINSHELL_LAWS(laws)
 *
 * makes finshell_law_1, by which finshell finds the laws of the array. Nothing has to be linked. A guide: doc/user_laws.md.
 */
#ifndef FINSHELL_LAW_H
#define FINSHELL_LAW_H

#include <string.h>

#include "finshell.h"

#if defined(_WIN32)
#define FINSHELL_LAW_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FINSHELL_LAW_EXPORT __attribute__((visibility("default")))
#else
#define FINSHELL_LAW_EXPORT
#endif

/* Whether two names are the same; capitals do not matter. Since 0.1. */
static inline int finshell_same_name(const char *a, const char *b)
{
   for (; *a || *b; a++, b++) {
      const char x = (char)(*a >= 'A' && *a <= 'Z' ? *a + 32 : *a), y = (char)(*b >= 'A' && *b <= 'Z' ? *b + 32 : *b);
      if (x != y) return 0;
   }
   return 1;
}

/* The law of this name; without a name the only one. NULL: there is none, and the message says what there is.
 * Since 0.1. */
static inline const finshell_law *finshell_find_law(const finshell_law *laws, size_t n, const char *name, char *message, int32_t size)
{
   size_t i;
   if (name[0] == '\0' && n == 1) return laws;
   for (i = 0; i < n; i++)
      if (finshell_same_name(laws[i].name, name)) return laws + i;
   if (size > 0) {
      size_t left = (size_t)size - 1;
      message[0] = '\0';
      strncat(message, name[0] ? "there is no law '" : "which law is not said", left);
      if (name[0]) {
         strncat(message, name, left - strlen(message));
         strncat(message, "'", left - strlen(message));
      }
      strncat(message, "; laws: ", left - strlen(message));
      for (i = 0; i < n; i++) {
         if (i > 0) strncat(message, ", ", left - strlen(message));
         strncat(message, laws[i].name, left - strlen(message));
      }
   }
   return NULL;
}

#ifdef __cplusplus
#define FINSHELL_LAWS_LINKAGE extern "C"
#else
#define FINSHELL_LAWS_LINKAGE
#endif

/* The entry point for an array of laws. */
#define FINSHELL_LAWS(laws)                                                                                                          \
   FINSHELL_LAWS_LINKAGE FINSHELL_LAW_EXPORT const finshell_law *finshell_law_1(const char *name, char *message, int32_t size);     \
   FINSHELL_LAWS_LINKAGE FINSHELL_LAW_EXPORT const finshell_law *finshell_law_1(const char *name, char *message, int32_t size)      \
   {                                                                                                                                \
      return finshell_find_law(laws, sizeof laws / sizeof *laws, name, message, size);                                              \
   }

#endif
