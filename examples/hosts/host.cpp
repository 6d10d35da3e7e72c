// A host in C++: meshes, supports and Newton's method are its own, finshell assembles, Eigen solves.    host hemisphere | disk
#include <Eigen/SparseCholesky>
#include <cstdio>
#include <cstdlib>
#include <finshell.h>
#include <string>

using Real = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Int = Eigen::Matrix<int32_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
static finshell_status status;
static void check(int32_t code) { if (code) std::fprintf(stderr, "%s\n", status.message), std::exit(1); }

struct Problem {
   finshell_section *section = nullptr;
   Real X, load, normals, pressure; // (nodes, 3), (nodes, 6); (elements, 9), (elements, 1) or empty
   Int triangles, held, straight;   // (elements, 3), (nodes, 6); (elements, 3) or empty
   int steps = 1;
};

// Displacements (nodes, 3) in equilibrium with the loads, which grow in steps.
static Real solve(const Problem &p) {
   finshell_mesh mesh = {};
   mesh.size = sizeof mesh, mesh.nodes = p.X.rows(), mesh.elements = p.triangles.rows(), mesh.triangle = FINSHELL_UPPER;
   mesh.triangles = p.triangles.data(), mesh.held = p.held.data();
   finshell_assembly *a;
   check(finshell_assembly_create(&mesh, 1, &p.section, &a, &status));
   int32_t rows;
   int64_t entries;
   finshell_assembly_size(a, nullptr, &rows, &entries, nullptr);
   Int row(mesh.nodes, 6), starts(1, rows + 1), columns(1, entries);
   finshell_assembly_freedoms(a, row.data(), nullptr);
   finshell_assembly_pattern(a, starts.data(), columns.data(), nullptr);
   Real u = Real::Zero(mesh.nodes, 3), q = Real::Zero(mesh.nodes, 4), values(1, entries), d(mesh.nodes, 6);
   q.col(0).setOnes();
   finshell_elements e = {};
   e.size = sizeof e, e.n = mesh.elements, e.convention = FINSHELL_ROTATION_QUATERNION;
   e.X = p.X.data(), e.u = u.data(), e.rotations = q.data();
   e.normals = p.normals.size() ? p.normals.data() : nullptr, e.straight = p.straight.size() ? p.straight.data() : nullptr;
   Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver;
   for (int step = 1; step <= p.steps; step++) {
      do {
         const double factor = double(step) / p.steps;
         Real r = -factor * p.load; // residual: internal minus external forces
         values.setZero();
         check(finshell_assembly_evaluate(a, 1, &p.section, &e, nullptr, r.data(), values.data(), nullptr, &status));
         if (p.pressure.size()) // form 1 has a symmetric stiffness, and differs at held freedoms only
            check(finshell_assembly_pressure(a, &e, p.pressure.data(), 1, nullptr, -factor, r.data(), values.data(), nullptr, &status));
         // an upper triangle by rows is a lower one by columns
         solver.compute(Eigen::Map<Eigen::SparseMatrix<double>>(rows, rows, entries, starts.data(), columns.data(), values.data()));
         Eigen::VectorXd b(rows);
         for (int i = 0; i < row.size(); i++) if (row.data()[i] >= 0) b[row.data()[i]] = -r.data()[i];
         b = solver.solve(b).eval();
         for (int i = 0; i < row.size(); i++) d.data()[i] = row.data()[i] < 0 ? 0 : b[row.data()[i]];
         d *= std::min(1.0, 0.4 / d.rightCols(3).cwiseAbs().maxCoeff()); // no node turns by more at once
         u += d.leftCols(3);
         check(finshell_rotation_update(mesh.nodes, Real(d.rightCols(3)).data(), q.data(), nullptr, &status));
      } while (d.leftCols(3).cwiseAbs().maxCoeff() > 1e-11 * u.cwiseAbs().maxCoeff());
   }
   finshell_assembly_destroy(a);
   return u;
}

#include "problems.h" // hemisphere and disk: nodes, triangles, supports

int main(int, char **arguments) {
   const bool disk = arguments[1] == std::string("disk");
   const Problem p = disk ? make_disk(12) : make_hemisphere(16);
   const Real u = solve(p);
   if (disk) std::printf("centre %.15e\n", u(0, 2));
   else std::printf("pulled %.15e\npushed %.15e\n", u(0, 0), -u(16 * 17, 1));
}
