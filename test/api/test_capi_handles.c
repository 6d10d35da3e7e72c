/* Pointers that are no section: destroyed, zeroed, overwritten, of something else. Not among the programs that valgrind and the
 * sanitizers see: to look at freed memory is what is tested. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"

/* All functions that take a section refuse this one. */
static void refused(const finshell_section *section)
{
   patch p = new_patch(3, 1);
   double energy[3] = {7, 7, 7}, stretch[3] = {7, 7, 7}, lumped[54];
   finshell_status status;
   int32_t codes[3] = {7, 7, 7};
   lumped[0] = 7;
   memset(&status, 0x55, sizeof status);
   CHECK(finshell_evaluate(section, 3, p.X, p.u, p.vector, 1, NULL, NULL, energy, NULL, NULL, codes, 1, &status) == -1);
   CHECK(status.code == -1 && status.index == -1 && strstr(status.message, "finshell_evaluate: section is no handle") != NULL);
   CHECK(finshell_recover(section, 3, p.X, p.u, p.vector, 1, NULL, NULL, stretch, NULL, NULL, NULL, codes, &status) == -1);
   CHECK(strstr(status.message, "finshell_recover: section is no handle") != NULL);
   CHECK(finshell_mass_matrix(section, 3, p.X, NULL, lumped, codes, &status) == -1);
   CHECK(strstr(status.message, "finshell_mass_matrix: section is no handle") != NULL);
   CHECK(finshell_evaluate(section, 0, NULL, NULL, NULL, 1, NULL, NULL, NULL, NULL, NULL, NULL, 1, NULL) == -1);
   finshell_properties properties = {0};
   finshell_layer layer = {0};
   properties.size = sizeof properties;
   layer.size = sizeof layer;
   CHECK(finshell_section_properties(section, &properties, &status) == -1 && properties.layers == 0);
   CHECK(strstr(status.message, "finshell_section_properties: section is no handle") != NULL);
   CHECK(finshell_section_layer(section, 0, &layer, NULL) == -1 && layer.points == 0);
   CHECK(finshell_section_parameter(section, 0, 0, NULL, 0, energy, NULL) == -1);
   CHECK(finshell_section_stiffness(section, lumped, NULL) == -1);
   CHECK(energy[0] == 7 && stretch[0] == 7 && lumped[0] == 7 && codes[0] == 7);
   free_patch(p);
}

int main(void)
{
   double numbers[40] = {0};
   finshell_elements elements;
   finshell_status status;
   silence();
   memset(&elements, 0, sizeof elements);
   memset(&status, 0xff, sizeof status);

   /* of something else */
   refused((finshell_section *)numbers);
   refused((finshell_section *)&elements);
   refused((finshell_section *)&status);
   refused((finshell_section *)"finshell");
   refused((finshell_section *)(uintptr_t)1);
   finshell_section_destroy((finshell_section *)numbers);
   finshell_section_destroy((finshell_section *)(uintptr_t)1);
   finshell_section_destroy(NULL);

   /* destroyed, once and twice, with and without other sections that take its place */
   for (int i = 0; i < 20; i++) {
      finshell_section *dead = i % 2 ? rubber(0.1) : laminate(0.01);
      finshell_section_destroy(dead);
      refused(dead);
      finshell_section_destroy(dead);
      refused(dead);
   }
   finshell_section_builder *gone = begin();
   finshell_builder_destroy(gone);
   CHECK(finshell_builder_option(gone, "arc", 1, &status) == -1);
   CHECK(strstr(status.message, "finshell_builder_option: builder is no handle") != NULL);
   finshell_builder_destroy(gone);
   finshell_section *many[50];
   for (int i = 0; i < 50; i++) many[i] = rubber(0.01 + 0.001 * i);
   for (int i = 0; i < 50; i += 2) finshell_section_destroy(many[i]);
   for (int i = 0; i < 50; i += 2) refused(many[i]);
   patch p = new_patch(3, 1);
   for (int i = 1; i < 50; i += 2) {
      CHECK(finshell_evaluate(many[i], 3, p.X, p.u, p.vector, 1, NULL, NULL, numbers, NULL, NULL, NULL, 1, &status) == 0);
      CHECK(numbers[0] > 0);
      finshell_section_destroy(many[i]);
   }
   free_patch(p);

   /* zeroed: its first bytes only, for the rest belongs to the library */
   finshell_section *zeroed = rubber(0.1);
   memset(zeroed, 0, 8);
   refused(zeroed);
   finshell_section_destroy(zeroed);
   return finish();
}
