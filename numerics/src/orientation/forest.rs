//! Disjoint sets of points with signs relative to one another.

/// Disjoint sets whose members have a sign relative to their root.
#[derive(Clone)]
pub(super) struct SignedForest {
    parents: Vec<usize>,
    signs: Vec<f64>,
    sizes: Vec<usize>,
}

/// The place of a member in a forest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Membership {
    pub root: usize,
    /// Sign relative to the root, +1 or −1.
    pub sign: f64,
}

impl SignedForest {
    pub(super) fn new(n: usize) -> Self {
        Self { parents: (0..n).collect(), signs: vec![1.0; n], sizes: vec![1; n] }
    }

    /// Finds the root of a member and the sign relative to it.
    ///
    /// Depth is logarithmic, because smaller sets join larger ones.
    pub(super) fn find(&mut self, member: usize) -> Membership {
        let (mut root, mut sign) = (member, 1.0);
        while self.parents[root] != root {
            sign *= self.signs[root];
            root = self.parents[root];
        }
        (self.parents[member], self.signs[member]) = (root, sign);
        Membership { root, sign }
    }

    /// Finds the root and sign of every member.
    pub(super) fn find_all(&mut self) -> Vec<Membership> {
        (0..self.parents.len()).map(|member| self.find(member)).collect()
    }

    /// Returns how many members the set with this root has.
    pub(super) fn size(&self, root: usize) -> usize {
        self.sizes[root]
    }

    /// Joins the sets of two members that have this sign relative to one another. Members of one set keep
    /// their signs.
    pub(super) fn join(&mut self, a: usize, b: usize, sign: f64) {
        let (mut a, mut b) = (self.find(a), self.find(b));
        if a.root == b.root {
            return;
        }
        if self.sizes[a.root] < self.sizes[b.root] {
            std::mem::swap(&mut a, &mut b);
        }
        self.parents[b.root] = a.root;
        self.signs[b.root] = sign * a.sign * b.sign;
        self.sizes[a.root] += self.sizes[b.root];
    }
}
