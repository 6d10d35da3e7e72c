// The two problems of the hosts, in C++ (host.py has them, too).
// A quarter of a hemisphere with a hole of 18 degrees, pulled and pushed by 200 at its rim: Sze, Liu & Lo 2004, 3.4.
static Problem make_hemisphere(int n) {
   Problem p;
   const char *names[] = {"e", "nu"};
   const double values[] = {6.825e7, 0.3}, right = std::acos(0.0);
   check(finshell_section_create("linear_elastic", 2, names, values, 0.04, 0, nullptr, nullptr, &p.section, &status));
   const int nodes = (n + 1) * (n + 1), elements = 2 * n * n;
   p.X.resize(nodes, 3), p.load = Real::Zero(nodes, 6), p.held = Int::Zero(nodes, 6);
   p.triangles.resize(elements, 3), p.normals.resize(elements, 9), p.steps = 10;
   for (int i = 0; i <= n; i++)
      for (int j = 0; j <= n; j++) {
         const int node = i * (n + 1) + j;
         const double azimuth = right * i / n, colatitude = right * (1 - 0.8 * j / n);
         p.X.row(node) << 10 * std::sin(colatitude) * std::cos(azimuth), 10 * std::sin(colatitude) * std::sin(azimuth), 10 * std::cos(colatitude);
         if (i == 0) p.held.row(node) << 0, 1, 0, 1, 0, 1; // planes of symmetry
         if (i == n) p.held.row(node) << 1, 0, 0, 0, 1, 1;
         if (i == n || j == n) continue;
         p.triangles.row(2 * (i * n + j)) << node, node + n + 1, node + n + 2;
         p.triangles.row(2 * (i * n + j) + 1) << node, node + n + 2, node + 1;
      }
   for (int i = 0; i < 9 * elements; i++) p.normals.data()[i] = p.X(p.triangles.data()[i / 3], i % 3); // of a sphere: its points
   p.held(0, 2) = 1;
   p.load(0, 0) = 200, p.load(n * (n + 1), 1) = -200;
   return p;
}

// A quarter of a rubber disk with a hinged rim under a follower pressure of 17: Caselli & Bisegna, 3.1.
static Problem make_disk(int rings) {
   Problem p;
   const char *names[] = {"c10", "c01"};
   const double values[] = {80, 20}, right = std::acos(0.0);
   check(finshell_section_create("mooney_rivlin", 2, names, values, 0.5, 0, nullptr, nullptr, &p.section, &status));
   const int nodes = (rings + 1) * (rings + 1), elements = 2 * rings * rings;
   p.X.resize(nodes, 3), p.load = Real::Zero(nodes, 6), p.held = Int::Zero(nodes, 6), p.steps = 4;
   p.triangles.resize(elements, 3), p.straight = Int::Zero(elements, 3), p.pressure = Real::Constant(elements, 1, 17);
   for (int k = 0, e = 0; k <= rings; k++) {
      for (int j = 0; j <= 2 * k; j++) { // ring k begins with node k * k
         const double angle = k ? right * j / (2 * k) : 0, radius = 7.5 * k / rings;
         p.X.row(k * k + j) << radius * std::cos(angle), radius * std::sin(angle), 0;
         const bool y = j == 0, x = j == 2 * k, rim = k == rings;
         p.held.row(k * k + j) << (x || rim), (y || rim), rim, y, x, (x || y);
      }
      for (int s = 0; s < 2 && k > 0; s++)
         for (int c = 0; c < k; c++) {
            const int inner = (k - 1) * (k - 1) + s * (k - 1) + c, outer = k * k + s * k + c;
            if (k == rings) p.straight(e, 1) = 2; // the rim does not move
            p.triangles.row(e++) << inner, outer, outer + 1;
            if (c < k - 1) p.triangles.row(e++) << inner, outer + 1, inner + 1;
         }
   }
   return p;
}
