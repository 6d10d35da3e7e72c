/* Sections, their builders and laws from outside, of finshell.h and finshell_law.h, under guards (guards.h). */
#define _GNU_SOURCE
#include "guards.h"
#include "../../examples/user_laws/laws.c"

enum { n = 17, variables = 54 }; /* elements are computed by eights; states of an element of one layer of `prony` */

struct world {
   patch p;
   finshell_section *shell, *laminate, *sheet, *prony;
   int32_t threads;
};

/* What is neither section nor builder. */
static const int64_t nothing[32];

static const char *const rubber_names[] = {"c10", "c01"};
static const double rubber_values[] = {80, 20};

/* A builder with a layer that waits for its law. */
static finshell_section_builder *with_layer(void)
{
   finshell_section_builder *b = NULL;
   finshell_builder_begin(&b, NULL);
   finshell_builder_layer(b, 0.1, 30, 0, 1.5, NULL);
   return b;
}

static void prony_parameters(const char *names[4], double values[4])
{
   for (int i = 0; i < 4; i++) {
      names[i] = laws[2].parameter[i].name;
      values[i] = laws[2].parameter[i].example;
   }
}

/* ------------------------------------------------------------------ sections */

static void section_create(const world *w, results *r)
{
   const char *wrong[] = {"c10", "c02"};
   finshell_status status;
   finshell_section *section = NULL;
   (void)w;
   keep_status(r, finshell_section_create("mooney_rivlin", 2, rubber_names, rubber_values, 0.1, 0, NULL, NULL, &section, &status),
               &status);
   finshell_section_destroy(section);
   keep_status(r, finshell_section_create("mooney_rivlin", 2, wrong, rubber_values, 0.1, 0, NULL, NULL, &section, &status),
               &status);
}

static void section_destroy(const world *w, results *r)
{
   finshell_section *section = NULL;
   finshell_status status;
   (void)w;
   keep_status(r, finshell_section_create("mooney_rivlin", 2, rubber_names, rubber_values, 0.1, 0, NULL, NULL, &section, &status),
               &status);
   finshell_section_destroy(section);
   finshell_section_destroy(NULL);
   finshell_section_destroy((finshell_section *)nothing);
}

static void section_freedoms(const world *w, results *r)
{
   finshell_status status;
   keep_status(r, finshell_section_freedoms(w->shell, &status), &status);
   keep_status(r, finshell_section_freedoms(w->sheet, &status), &status);
   keep_status(r, finshell_section_freedoms(NULL, &status), &status);
}

static void section_properties(const world *w, results *r)
{
   finshell_properties found = {0};
   finshell_status status;
   found.size = sizeof found;
   keep_status(r, finshell_section_properties(w->laminate, &found, &status), &status);
   KEEP(found.layers);
   KEEP(found.isotropic);
   KEEP(found.thickness);
   KEEP(found.areal_mass);
   KEEP(found.rotatory_inertia);
   found.size = 0;
   keep_status(r, finshell_section_properties(w->laminate, &found, &status), &status);
}

static void section_layer(const world *w, results *r)
{
   finshell_layer layer = {0};
   finshell_status status;
   layer.size = sizeof layer;
   for (int32_t i = -1; i < 4; i++) {
      keep_status(r, finshell_section_layer(w->laminate, i, &layer, &status), &status);
      keep_text(r, layer.law);
      KEEP(layer.points);
      KEEP(layer.angle);
      KEEP(layer.height);
   }
}

static void section_parameter(const world *w, results *r)
{
   char name[8] = "";
   double value = 0;
   finshell_status status;
   for (int32_t i = -1; i < 5; i++) {
      keep_status(r, finshell_section_parameter(w->laminate, 1, i, name, sizeof name, &value, &status), &status);
      keep_text(r, name);
      KEEP(value);
   }
   keep_status(r, finshell_section_parameter(w->laminate, 3, 0, NULL, 0, NULL, &status), &status);
}

static void section_stiffness(const world *w, results *r)
{
   double stiffness[6][6];
   finshell_status status;
   keep_status(r, finshell_section_stiffness(w->laminate, &stiffness[0][0], &status), &status);
   KEEP(stiffness);
   keep_status(r, finshell_section_stiffness(w->sheet, &stiffness[0][0], &status), &status);
   KEEP(stiffness);
   keep_status(r, finshell_section_stiffness(w->laminate, NULL, &status), &status);
}

static void section_states(const world *w, results *r)
{
   finshell_status status;
   keep_status(r, finshell_section_states(w->prony, &status), &status);
   keep_status(r, finshell_section_states(w->shell, &status), &status);
   keep_status(r, finshell_section_states((finshell_section *)nothing, &status), &status);
}

static void section_layer_states(const world *w, results *r)
{
   int32_t first = 0, points = 0, each = 0;
   finshell_status status;
   keep_status(r, finshell_section_layer_states(w->prony, 0, &first, &points, &each, &status), &status);
   KEEP(first);
   KEEP(points);
   KEEP(each);
   keep_status(r, finshell_section_layer_states(w->prony, 1, &first, NULL, NULL, &status), &status);
}

/* ------------------------------------------------------------------ builders */

static void builder_begin(const world *w, results *r)
{
   finshell_section_builder *b = NULL;
   finshell_status status;
   (void)w;
   keep_status(r, finshell_builder_begin(&b, &status), &status);
   finshell_builder_destroy(b);
   keep_status(r, finshell_builder_begin(NULL, &status), &status);
}

static void builder_destroy(const world *w, results *r)
{
   finshell_section_builder *b = with_layer();
   finshell_status status;
   (void)w;
   keep_status(r, finshell_builder_law(b, "mooney_rivlin", 2, rubber_names, rubber_values, &status), &status);
   finshell_builder_destroy(b);
   finshell_builder_destroy(NULL);
   finshell_builder_destroy((finshell_section_builder *)nothing);
}

static void builder_layer(const world *w, results *r)
{
   finshell_section_builder *b = NULL;
   finshell_section *section = NULL;
   finshell_status status;
   (void)w;
   finshell_builder_begin(&b, NULL);
   for (int i = 0; i < 20; i++) {
      keep_status(r, finshell_builder_layer(b, i < 19 ? 0.1 : NAN, 4 * i, 2, i, &status), &status);
      finshell_builder_law(b, "mooney_rivlin", 2, rubber_names, rubber_values, NULL);
   }
   keep_status(r, finshell_builder_build(b, &section, &status), &status);
   finshell_builder_destroy(b);
   keep_status(r, finshell_builder_layer(NULL, 0.1, 0, 0, 0, &status), &status);
}

static void builder_law(const world *w, results *r)
{
   static const char *const wrong[] = {"mooney_rivlin", "no such law", "plugin:/nowhere.so#law", "plugin:libm.so.6"};
   finshell_status status;
   (void)w;
   for (int i = 0; i < 4; i++) {
      finshell_section_builder *b = with_layer();
      keep_status(r, finshell_builder_law(b, wrong[i], 2, rubber_names, rubber_values, &status), &status);
      /* of a layer that has a law, or of a builder that is spoilt */
      keep_status(r, finshell_builder_law(b, "mooney_rivlin", 2, rubber_names, rubber_values, &status), &status);
      finshell_builder_destroy(b);
   }
}

static void builder_own_law(const world *w, results *r)
{
   const char *names[4];
   double values[4];
   finshell_law law = laws[2];
   finshell_status status;
   finshell_section *section = NULL;
   (void)w;
   prony_parameters(names, values);
   for (int i = 0; i < 3; i++) {
      finshell_section_builder *b = with_layer();
      if (i == 1) law.kind = 7;
      if (i == 2) law.evaluate = NULL;
      keep_status(r, finshell_builder_own_law(b, &law, 4, names, values, &status), &status);
      keep_status(r, finshell_builder_build(b, &section, &status), &status);
      keep_status(r, finshell_section_states(section, &status), &status);
      finshell_section_destroy(section);
      finshell_builder_destroy(b);
   }
}

static void builder_option(const world *w, results *r)
{
   static const char *const option[] = {"formulation", "beta0", "no such option", "arc"};
   finshell_section_builder *b = with_layer();
   finshell_status status;
   (void)w;
   for (int i = 0; i < 4; i++) keep_status(r, finshell_builder_option(b, option[i], i == 1 ? 0.5 : 1, &status), &status);
   finshell_builder_destroy(b);
}

static void builder_build(const world *w, results *r)
{
   finshell_section_builder *b = with_layer();
   finshell_section *section = NULL;
   finshell_status status;
   (void)w;
   keep_status(r, finshell_builder_build(b, &section, &status), &status); /* without a law */
   finshell_builder_destroy(b);
   b = with_layer();
   finshell_builder_law(b, "mooney_rivlin", 2, rubber_names, rubber_values, NULL);
   for (int i = 0; i < 2; i++) {
      keep_status(r, finshell_builder_build(b, &section, &status), &status);
      keep_status(r, finshell_section_freedoms(section, &status), &status);
      finshell_section_destroy(section);
   }
   finshell_builder_destroy(b);
}

/* ------------------------------------------------------------------ laws from outside */

static void law_check(const world *w, results *r)
{
   const char *names[4];
   double values[4];
   finshell_law law = laws[2];
   finshell_law_finding finding[FINSHELL_LAW_FINDINGS];
   finshell_status status;
   (void)w;
   prony_parameters(names, values);
   for (int i = 0; i < 3; i++) {
      if (i == 1) values[0] = 1e300; /* overflows are the law's affair */
      if (i == 2) law.size = 0;
      keep_status(r, finshell_law_check(&law, NULL, 4, names, values, finding, &status), &status);
      for (int k = 0; k < FINSHELL_LAW_FINDINGS && i == 0; k++) {
         keep_text(r, finding[k].name);
         KEEP(finding[k].found);
         KEEP(finding[k].passed);
      }
   }
   keep_status(r, finshell_law_check(NULL, "mooney_rivlin", 2, rubber_names, rubber_values, NULL, &status), &status);
   keep_status(r, finshell_law_check(NULL, "plugin:/nowhere.so#law", 0, NULL, NULL, NULL, &status), &status);
}

static void find_law(const world *w, results *r)
{
   static const char *const name[] = {"prony", "lee_sacks", "", "no such law"};
   char message[60];
   (void)w;
   for (int i = 0; i < 4; i++) {
      message[0] = '\0';
      const finshell_law *law = finshell_find_law(laws, 3, name[i], message, sizeof message);
      keep_text(r, law ? law->name : message);
   }
}

static void same_name(const world *w, results *r)
{
   static const char *const other[] = {"prony", "PRONY", "pron", "prony2", ""};
   (void)w;
   for (int i = 0; i < 5; i++) {
      int value = finshell_same_name("Prony", other[i]);
      KEEP(value);
   }
}

/* Not functions of the headers: what a law of the caller's does under the same guards, in threads of the library as well. */
static void law_in_elements(const world *w, results *r)
{
   static double begin_of[n][variables];
   double energy[n], force[n][18], tangent[n][18][18], end_of[n][variables], wrong[n][9];
   int32_t codes[n];
   finshell_elements b = with_own(block_of(w->p, FINSHELL_ROTATION_VECTOR, w->p.normals), w->p);
   finshell_status status;
   b.threads = w->threads;
   b.states_begin = &begin_of[0][0];
   b.states_end = &end_of[0][0];
   b.time_step = 0.5;
   keep_status(r, finshell_elements_evaluate(w->prony, &b, energy, &force[0][0], &tangent[0][0][0], codes, &status), &status);
   KEEP(energy);
   KEEP(force);
   KEEP(tangent);
   KEEP(end_of);
   memcpy(wrong, w->p.u, sizeof wrong);
   wrong[3][4] = 1e200; /* strains overflow, in the library or in the law */
   wrong[9][4] = 1e150;
   b.u = &wrong[0][0];
   keep_status(r, finshell_elements_evaluate(w->prony, &b, energy, &force[0][0], NULL, codes, &status), &status);
   KEEP(codes);
   KEEP(force);
}

static const entry all[] = {
   ENTRY(section_create), ENTRY(section_destroy), ENTRY(section_freedoms), ENTRY(section_properties), ENTRY(section_layer),
   ENTRY(section_parameter), ENTRY(section_stiffness), ENTRY(section_states), ENTRY(section_layer_states),
   ENTRY(builder_begin), ENTRY(builder_destroy), ENTRY(builder_layer), ENTRY(builder_law), ENTRY(builder_own_law),
   ENTRY(builder_option), ENTRY(builder_build), ENTRY(law_check), ENTRY(find_law), ENTRY(same_name),
   {"a law in elements", law_in_elements},
};

int main(int argc, char **argv)
{
   const char *names[4];
   double values[4];
   finshell_section_builder *b;
   const char *mu[] = {"mu"}, *options[] = {"membrane", "wrinkling"};
   const double two[] = {2}, chosen[] = {1, 1};
   world w = {0}, several;
   silence();
   w.p = new_patch(n, 5);
   w.threads = 1;
   w.shell = rubber(0.1);
   w.laminate = laminate(0.02);
   CHECK(finshell_section_create("neo_hookean", 1, mu, two, 0.1, 2, options, chosen, &w.sheet, NULL) == 0);
   b = with_layer();
   prony_parameters(names, values);
   CHECK(finshell_builder_own_law(b, &laws[2], 4, names, values, NULL) == 0);
   w.prony = built(b);
   CHECK(finshell_section_states(w.prony, NULL) == variables);
   several = w;
   several.threads = 4;
   guard(all, sizeof all / sizeof *all, &w, &several, argc, argv);
   finshell_section_destroy(w.shell);
   finshell_section_destroy(w.laminate);
   finshell_section_destroy(w.sheet);
   finshell_section_destroy(w.prony);
   free_patch(w.p);
   return finish();
}
