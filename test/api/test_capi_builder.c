/* Sections of layers by the builder: what is refused, by which words, and that a call that fails spoils what follows; a builder that
 * goes on after a section; many threads with builders of their own. Versions as numbers. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"
#include <pthread.h>

static finshell_status status;
static const char *names[] = {"c10", "c01"};
static const double values[] = {80, 20};

static void refused(int32_t code, const char *word, int line)
{
   check(code == FINSHELL_INVALID_ARGUMENT && status.code == code && status.index == -1 && status.failed == 0, word, line);
   if (!strstr(status.message, word)) check(0, status.message, line);
   memset(&status, 0x55, sizeof status);
}
#define REFUSED(call, word) refused((call), (word), __LINE__)

static int32_t rubber_layer(finshell_section_builder *b, double thickness)
{
   finshell_builder_layer(b, thickness, 0, 0, 0, NULL);
   return finshell_builder_law(b, "mooney_rivlin", 2, names, values, &status);
}

/* The builder refuses to build, by a word, and goes. */
static void refuses(finshell_section_builder *b, const char *word, int line)
{
   finshell_section *s = (finshell_section *)&status;
   refused(finshell_builder_build(b, &s, &status), word, line);
   check(s == NULL, "no section", line);
   finshell_builder_destroy(b);
}
#define REFUSES(builder, word) refuses((builder), (word), __LINE__)

static void numbers_of_layers(void)
{
   static const struct { double thickness, angle; int32_t points; double density; const char *word; } wrong[] = {
      {0, 0, 0, 0, "layer 2: thickness is"}, {-1, 0, 0, 0, "layer 2: thickness is"}, {NAN, 0, 0, 0, "layer 2: thickness is"},
      {1, INFINITY, 0, 0, "layer 2: angle is"}, {1, 0, -2, 0, "layer 2: thickness_points is -2"},
      {1, 0, 13, 0, "layer 2: thickness_points is 13"}, {1, 0, 0, -1, "layer 2: density is"}, {1, 0, 0, NAN, "layer 2: density is"}};
   for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
      finshell_section_builder *b = begin();
      CHECK(rubber_layer(b, 1) == 0 && status.code == 0 && status.index == -1 && status.message[0] == 0);
      CHECK(finshell_builder_layer(b, wrong[i].thickness, wrong[i].angle, wrong[i].points, wrong[i].density, NULL) == 0);
      CHECK(finshell_builder_law(b, "mooney_rivlin", 2, names, values, NULL) == 0);
      REFUSES(b, wrong[i].word);
   }
   REFUSES(begin(), "a section needs at least one layer");
   finshell_section_builder *b = begin();
   CHECK(rubber_layer(b, 1) == 0 && finshell_builder_layer(b, 1, 0, 0, 0, &status) == 0);
   REFUSES(b, "finshell_builder_build: layer 2: a material law is missing");
}

static void laws(void)
{
   const double bad[] = {NAN, 20};
   finshell_section_builder *b = begin();
   REFUSED(finshell_builder_law(b, "mooney_rivlin", 2, names, values, &status), "there is no layer yet");
   REFUSES(b, "finshell_builder_law: there is no layer yet");
   b = begin();
   CHECK(rubber_layer(b, 1) == 0 && rubber_layer(b, 1) == 0);
   REFUSED(finshell_builder_law(b, "neo_hookean", 0, NULL, NULL, &status), "layer 2: material law 'neo_hookean': parameter 'mu' is missing");
   finshell_builder_destroy(b);
   b = begin();
   CHECK(rubber_layer(b, 1) == 0);
   REFUSED(finshell_builder_law(b, "mooney_rivlin", 2, names, values, &status), "layer 1: it has the law 'mooney_rivlin' already");
   finshell_builder_destroy(b);
   static const struct { const char *law; int32_t n; const char *word; } wrong[] = {
      {"rubber", 2, "layer 2: unknown material law 'rubber': known laws are"}, {NULL, 2, "layer 2: the name of the material law is NULL"},
      {"mooney_rivlin", -1, "layer 2: the number of parameters is -1"}, {"mooney_rivlin", 2, "layer 2: material law 'mooney_rivlin'"}};
   for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
      b = begin();
      CHECK(rubber_layer(b, 1) == 0 && finshell_builder_layer(b, 1, 0, 0, 0, NULL) == 0);
      REFUSED(finshell_builder_law(b, wrong[i].law, wrong[i].n, names, bad, &status), wrong[i].word);
      /* it stays so, whatever is said */
      REFUSED(finshell_builder_layer(b, 1, 0, 0, 0, &status), wrong[i].word);
      REFUSED(finshell_builder_option(b, "offset", 1, &status), wrong[i].word);
      REFUSED(finshell_builder_law(b, "mooney_rivlin", 2, names, values, &status), "finshell_builder_law: layer 2");
      REFUSES(b, wrong[i].word);
   }
}

static void options(void)
{
   char long_name[5000];
   memset(long_name, 'x', sizeof long_name - 1);
   long_name[sizeof long_name - 1] = 0;
   const struct { const char *name; double value; const char *word; } wrong[] = {
      {NULL, 1, "the name of the option is NULL"}, {"", 1, "unknown option ''; options are formulation, beta0, arc"},
      {"thickness_points", 3, "unknown option 'thickness_points'"}, {"density", 3, "unknown option 'density'; options are"},
      {long_name, 3, "unknown option 'xxxx"}, {"arc", 2, "arc is 2, expected 0 or 1"}, {"formulation", 1.5, "expected a small whole number"},
      {"offset, membrane", 1, "unknown option"}};
   for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
      finshell_section_builder *b = begin();
      CHECK(rubber_layer(b, 1) == 0);
      REFUSED(finshell_builder_option(b, wrong[i].name, wrong[i].value, &status), wrong[i].word);
      REFUSES(b, "finshell_builder_option: ");
   }
   finshell_section_builder *b = begin();
   CHECK(finshell_builder_option(b, "offset", 1, &status) == 0); /* the order does not matter */
   REFUSED(finshell_builder_option(b, "offset", 1, &status), "option 'offset' is given twice");
   finshell_builder_destroy(b);
   b = begin();
   CHECK(rubber_layer(b, 1) == 0 && finshell_builder_option(b, "beta0", -1, &status) == 0);
   REFUSES(b, "beta0 is");
}

static void handles(void)
{
   finshell_section *s = rubber(0.1);
   finshell_section_builder *none = NULL, *other = (finshell_section_builder *)s;
   REFUSED(finshell_builder_begin(NULL, &status), "builder, where the handle is put, is NULL");
   REFUSED(finshell_builder_layer(none, 1, 0, 0, 0, &status), "finshell_builder_layer: builder is NULL");
   REFUSED(finshell_builder_law(none, "mooney_rivlin", 2, names, values, &status), "finshell_builder_law: builder is NULL");
   REFUSED(finshell_builder_option(none, "arc", 1, &status), "finshell_builder_option: builder is NULL");
   REFUSED(finshell_builder_build(none, &s, &status), "finshell_builder_build: builder is NULL");
   CHECK(s == NULL);
   REFUSED(finshell_builder_layer(other, 1, 0, 0, 0, &status), "builder is no handle"); /* but a section */
   finshell_builder_destroy(NULL);
   finshell_builder_destroy(other);
   finshell_section_destroy((finshell_section *)other);
   finshell_section_builder *b = begin();
   REFUSED(finshell_section_freedoms((finshell_section *)b, &status), "section is no handle");
   finshell_section_destroy((finshell_section *)b);
   CHECK(rubber_layer(b, 0.1) == 0);
   REFUSED(finshell_builder_build(b, NULL, &status), "section, where the handle is put, is NULL");
   finshell_section_destroy(built(b));
}

/* One layer by the builder is one by the short form; a builder goes on after a section; sections outlive it. */
static void goes_on(void)
{
   patch p = new_patch(3, 5);
   double force[4][3][18];
   finshell_section *s[4] = {NULL};
   const char *option[] = {"offset", "density", "thickness_points"};
   const double chosen[] = {0.02, 3, 4};
   CHECK(finshell_section_create("mooney_rivlin", 2, names, values, 0.1, 3, option, chosen, &s[0], NULL) == 0);
   finshell_section_builder *b = begin();
   CHECK(finshell_builder_option(b, "offset", 0.02, NULL) == 0 && finshell_builder_layer(b, 0.1, 0, 4, 3, NULL) == 0);
   CHECK(finshell_builder_law(b, "Mooney_Rivlin", 2, names, values, NULL) == 0);
   CHECK(finshell_builder_build(b, &s[1], &status) == 0 && finshell_builder_build(b, &s[2], NULL) == 0);
   CHECK(rubber_layer(b, 0.1) == 0);
   s[3] = built(b);
   for (int i = 0; i < 4; i++) {
      CHECK(finshell_evaluate(s[i], 3, p.X, p.u, p.vector, 1, NULL, p.direction, NULL, force[i][0], NULL, NULL, 1, NULL) == 0);
      finshell_section_destroy(s[i]);
   }
   CHECK(memcmp(force[0], force[1], sizeof force[0]) == 0 && memcmp(force[0], force[2], sizeof force[0]) == 0);
   CHECK(fabs(force[3][0][0] - force[0][0][0]) > 1e-3);
   free_patch(p);
}

static void *work(void *argument)
{
   double *energy = argument;
   patch p = new_patch(1, 3);
   for (int i = 0; i < 20; i++) {
      finshell_section *s = NULL;
      finshell_section_builder *b = NULL;
      finshell_builder_begin(&b, NULL);
      for (int l = 0; l < 3; l++) {
         finshell_builder_layer(b, 0.1, 0, 0, 0, NULL);
         finshell_builder_law(b, "mooney_rivlin", 2, names, values, NULL);
      }
      if (i % 5 == 4) finshell_builder_option(b, "arcs", 1, NULL); /* somebody's mistake is nobody else's */
      if (finshell_builder_build(b, &s, NULL) == 0) finshell_evaluate(s, 1, p.X, p.u, p.vector, 1, NULL, NULL, &energy[i], NULL, NULL, NULL, 1, NULL);
      finshell_builder_destroy(b);
      finshell_section_destroy(s);
   }
   free_patch(p);
   return NULL;
}

static void threads(void)
{
   enum { n = 64 };
   static double energy[n][20];
   pthread_t thread[n];
   for (int i = 0; i < n; i++) CHECK(pthread_create(&thread[i], NULL, work, energy[i]) == 0);
   for (int i = 0; i < n; i++) CHECK(pthread_join(thread[i], NULL) == 0);
   CHECK(energy[0][0] > 0);
   for (int i = 0; i < n; i++)
      for (int j = 0; j < 20; j++) CHECK_CLOSE(energy[i][j], j % 5 == 4 ? 0 : energy[0][0], 0);
}

static void versions(void)
{
   char text[32];
   CHECK(finshell_version_number() == FINSHELL_VERSION_NUMBER);
   snprintf(text, sizeof text, "%d.%d.%d", FINSHELL_VERSION_MAJOR, FINSHELL_VERSION_MINOR, FINSHELL_VERSION_PATCH);
   CHECK(strcmp(text, FINSHELL_VERSION) == 0 && strcmp(text, finshell_version_text()) == 0);
#if FINSHELL_VERSION_NUMBER < 100
   CHECK(0);
#endif
}

int main(void)
{
   silence();
   numbers_of_layers();
   laws();
   options();
   handles();
   goes_on();
   threads();
   versions();
   return finish();
}
