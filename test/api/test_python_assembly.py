#!/usr/bin/env python3
"""finshell.Assembly: against sums of elements by triplets, its arrays, its loads, its errors."""
import os
import sys
import unittest

try:
    import numpy as np
    import scipy.sparse as sparse
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

SOURCE = os.environ["FINSHELL_SOURCE_DIR"]
sys.path[:0] = [os.path.join(SOURCE, "api", "python"), os.path.join(SOURCE, "test", "api")]
import finshell  # noqa: E402

Q = finshell.Rotation.QUATERNION


def sheet(m=5):
    """Nodes (n, 3), triangles, displacements, quaternions."""
    rng = np.random.default_rng(3)
    y, x = np.divmod(np.arange((m + 1) ** 2), m + 1)
    X = np.stack([x, y, 0 * x], 1) + 0.1 * rng.uniform(-1, 1, (len(x), 3))
    at = np.flatnonzero((x < m) & (y < m))
    triangles = np.concatenate([np.stack([at, at + 1, at + m + 2], 1), np.stack([at, at + m + 2, at + m + 1], 1)])
    u = 0.1 * X * [1, 2, 0] + 0.02 * rng.uniform(-1, 1, X.shape)
    return X, triangles, u, finshell.rotation_exp(0.1 * rng.uniform(-1, 1, X.shape))


class Assembly(unittest.TestCase):
    def setUp(self):
        self.X, self.triangles, self.u, self.q = sheet()
        self.section = finshell.Section("mooney_rivlin", {"c10": 80.0, "c01": 20.0}, 0.1, density=2.0)
        self.held = np.zeros((len(self.X), 6), bool)
        self.held[self.X[:, 0] < 0.5] = True
        self.held[7, 2] = True

    def triplets(self, force, tangent, free):
        """Forces (nodes, 6) and the matrix of the free freedoms, as a host would by itself."""
        dofs = (6 * self.triangles[:, :, None] + np.arange(6)).reshape(-1, 18)
        n = 6 * len(self.X)
        f = np.bincount(dofs.ravel(), force.ravel(), n).reshape(-1, 6)
        k = sparse.coo_matrix((tangent.ravel(), (np.repeat(dofs, 18, axis=1).ravel(), np.tile(dofs, (1, 18)).ravel())), (n, n)).tocsr()
        return f, k[free][:, free].toarray()

    def test_against_triplets(self):
        free = np.flatnonzero(~self.held.ravel())
        e = self.section.evaluate(self.X[self.triangles], self.u[self.triangles], self.q[self.triangles], Q)
        f, k = self.triplets(e.force, e.tangent, free)
        p = np.linspace(1, 2, len(self.triangles))
        s = finshell.pressure(p, self.X[self.triangles], self.u[self.triangles], self.q[self.triangles], Q)
        fp, kp = self.triplets(s.force, s.stiffness, free)
        a = finshell.Assembly(self.triangles, self.section, held=self.held)
        self.assertEqual((a.rows, a.nodes, a.nodal), (len(free), len(self.X), 6))
        np.testing.assert_array_equal(a.freedoms.ravel()[free], np.arange(a.rows))
        r = a.evaluate(self.X, self.u, self.q, Q)
        self.assertAlmostEqual(r.energy, e.energy.sum(), delta=1e-12 * r.energy)
        np.testing.assert_allclose(r.force, f, atol=1e-12)
        np.testing.assert_allclose(r.matrix.toarray(), k, atol=1e-11)
        self.assertIs(a.pressure(p, self.X, self.u, self.q, Q, factor=-1, into=r), r)
        np.testing.assert_allclose(r.force, f - fp, atol=1e-12)
        np.testing.assert_allclose(r.matrix.toarray(), k - kp, atol=1e-11)
        upper = finshell.Assembly(self.triangles, self.section, held=self.held, upper=True)
        np.testing.assert_array_equal(upper.evaluate(self.X, self.u, self.q, Q).matrix.toarray(),
                                      np.triu(a.evaluate(self.X, self.u, self.q, Q).matrix.toarray()))
        self.assertIn(f"{a.rows} rows", repr(a))

    def test_nothing_is_copied(self):
        a = finshell.Assembly(self.triangles, self.section, held=self.held)
        values = np.ones(a.entries)
        m = a.matrix(values)
        self.assertTrue(np.shares_memory(m.data, values) and np.shares_memory(m.indices, a.indices) and np.shares_memory(m.indptr, a.indptr))
        self.assertEqual(m.indices.dtype, np.int32)
        before = a.evaluate(self.X, self.u, self.q, Q)
        address = before.matrix.data.ctypes.data
        a.mass(self.X, into=before)
        self.assertEqual(before.matrix.data.ctypes.data, address)
        np.testing.assert_array_equal(sparse.csr_matrix(m).has_canonical_format, True)

    def test_threads(self):
        X, triangles, u, q = sheet(40)
        a = finshell.Assembly(triangles, self.section)
        one = a.evaluate(X, u, q, Q)
        for threads in (0, 2, 5):
            many = a.evaluate(X, u, q, Q, threads=threads)
            self.assertEqual((one.energy, one.force.tobytes(), one.matrix.data.tobytes()), (many.energy, many.force.tobytes(), many.matrix.data.tobytes()))

    def test_rows(self):
        a = finshell.Assembly(self.triangles, self.section, held=self.held)
        values = np.arange(6.0 * len(self.X)).reshape(-1, 6)
        rows = a.to_rows(values)
        np.testing.assert_array_equal(rows, values[~self.held])
        np.testing.assert_array_equal(a.to_nodes(rows), np.where(self.held, 0, values))
        # numbers and pattern of the host: everything meets everything
        n = 6 * len(self.X) + 5
        own = np.where(self.held, -1, 5 + np.arange(6 * len(self.X))[::-1].reshape(-1, 6))
        full = (np.arange(0, n * n + 1, n), np.tile(np.arange(n), n))
        b = finshell.Assembly(self.triangles, self.section, freedoms=own, pattern=full)
        self.assertEqual((b.rows, b.entries), (n, n * n))
        k = b.evaluate(self.X, self.u, self.q, Q).matrix.toarray()
        np.testing.assert_allclose(k[np.ix_(own[~self.held], own[~self.held])], a.evaluate(self.X, self.u, self.q, Q).matrix.toarray(), atol=1e-12)
        with self.assertRaises(ValueError):
            finshell.Assembly(self.triangles, self.section, freedoms=own, pattern=(full[0][:-1], full[1]), rows=n)

    def test_loads(self):
        a = finshell.Assembly(self.triangles, self.section, held=self.held)
        x = self.X[self.triangles]
        area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum() / 2
        np.testing.assert_allclose(a.traction(self.X, [1.0, 2, 3], factor=2).sum(0), [2 * area, 4 * area, 6 * area, 0, 0, 0])
        np.testing.assert_allclose(a.gravity(self.X, [0, 0, -9.81]).sum(0), [0, 0, -9.81 * 0.2 * area, 0, 0, 0], atol=1e-12)
        lumped = a.mass(self.X, lumped=True)
        np.testing.assert_allclose(lumped[:, :3].sum(0), 0.2 * area)
        free = finshell.Assembly(self.triangles, self.section)
        ones = free.to_rows(np.tile([0, 1.0, 0, 0, 0, 0], (len(self.X), 1)))
        self.assertAlmostEqual(ones @ free.mass(self.X) @ ones, 0.2 * area)
        line = a.line_load([0, 1], [2, 0], [[0, 0, 5.0], [1, 0, 0]], self.X, self.u, self.q, Q)
        lengths = [np.linalg.norm(x[0, 0] - x[0, 2]), np.linalg.norm(x[1, 1] - x[1, 0])]
        np.testing.assert_allclose(line.force[:, :3].sum(0), [lengths[1], 0, 5 * lengths[0]], atol=1e-13)
        volume, gradient = a.volume(self.X, self.u, self.q, Q, side=np.arange(len(self.triangles)) % 2, origin=[0, 0, -1])
        moved = self.u.copy()
        moved[8, 2] += 1e-6
        self.assertAlmostEqual((a.volume(self.X, moved, self.q, Q, side=np.arange(len(self.triangles)) % 2, origin=[0, 0, -1])[0] - volume) / 1e-6,
                               gradient[8, 2], places=7)

    def test_membranes(self):
        film = finshell.Section("neo_hookean", {"mu": 5.0}, 0.1, membrane=True)
        a = finshell.Assembly(self.triangles, film)
        r = a.evaluate(self.X, self.u)
        self.assertEqual((a.nodal, a.rows, r.force.shape), (3, 3 * len(self.X), (len(self.X), 3)))
        part = np.arange(len(self.triangles)) % 2
        both = finshell.Assembly(self.triangles, [self.section, film], section_of=part)
        e = [s.evaluate(self.X[t], self.u[t], self.q[t], Q) for s, t in ((self.section, self.triangles[part == 0]), (film, self.triangles[part == 1]))]
        self.assertAlmostEqual(both.evaluate(self.X, self.u, self.q, Q).energy, e[0].energy.sum() + e[1].energy.sum())

    def test_guide(self):
        """The lines of doc/c_api.md."""
        import installed
        names = {"finshell": finshell, "np": np, "section": self.section}
        exec(installed.fragments("Python", "python"), names)
        self.assertEqual((names["a"].rows, names["r"].matrix.shape), (12, (12, 12)))
        self.assertTrue((names["du"][1:3, 2] > 0).all() and (names["du"][[0, 3]] == 0).all())

    def test_errors(self):
        a = finshell.Assembly(self.triangles, self.section)
        with self.assertRaisesRegex(finshell.Error, "names a node that is not in"):
            finshell.Assembly(self.triangles, self.section, nodes=20)
        with self.assertRaisesRegex(ValueError, "held has the shape"):
            finshell.Assembly(self.triangles, self.section, held=np.zeros((3, 6)))
        with self.assertRaisesRegex(ValueError, "u has the shape"):
            a.evaluate(self.X, self.u[:-1], self.q, Q)
        with self.assertRaisesRegex(finshell.Error, "rotations is NULL"):
            a.evaluate(self.X, self.u)
        with self.assertRaisesRegex(ValueError, "into.force"):
            a.evaluate(self.X, self.u, self.q, Q, into=finshell.Assembled(np.zeros((2, 6))))
        with self.assertRaisesRegex(ValueError, "into.matrix"):
            a.evaluate(self.X, self.u, self.q, Q, into=finshell.Assembled(None, sparse.eye(3).tocsr()))
        bad = self.u.copy()
        bad[9] = np.nan
        with self.assertRaises(finshell.Error) as caught:
            a.evaluate(self.X, bad, self.q, Q)
        r = a.evaluate(self.X, bad, self.q, Q, raise_errors=False)
        np.testing.assert_array_equal(r.codes == -3, (self.triangles == 9).any(1))
        self.assertEqual((caught.exception.index, caught.exception.failed), (np.flatnonzero(r.codes)[0], np.count_nonzero(r.codes)))
        self.assertTrue(np.isfinite(r.force).all() and np.isfinite(r.energy))


if __name__ == "__main__":
    unittest.main()
