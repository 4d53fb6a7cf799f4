//! A bounding volume hierarchy: which of many items a ray can hit, without testing each of them.

use nalgebra::{Point3, Vector3};

use crate::Ray;

/// An axis-aligned cuboid.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Aabb {
    pub(crate) least: Point3<f64>,
    pub(crate) most: Point3<f64>,
}

impl Aabb {
    /// The empty box.
    pub(crate) const NONE: Self = Self {
        least: Point3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        most: Point3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The smallest box that contains both.
    pub(crate) fn joined(&self, other: &Self) -> Self {
        Self { least: self.least.inf(&other.least), most: self.most.sup(&other.most) }
    }

    fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.least, &self.most)
    }

    /// The parameter at which a ray enters, if before `limit`; 0 from inside.
    fn enters(&self, ray: &Ray, inverse: &Vector3<f64>, limit: f64) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, limit);
        for axis in 0..3 {
            let a = (self.least[axis] - ray.origin[axis]) * inverse[axis];
            let b = (self.most[axis] - ray.origin[axis]) * inverse[axis];
            // A ray in the plane of a face gives NaN there, which must not affect the other faces.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some(enter)
    }
}

/// The most items of a leaf, which are tested one after the other.
const LEAF_ITEMS: usize = 4;
/// More than the depth of a tree that halves its items.
const STACK: usize = 64;

#[derive(Clone, PartialEq, Debug)]
struct Node {
    bounds: Aabb,
    /// In a leaf, the first of its items; otherwise the second child (the first child follows its parent).
    at: u32,
    /// The number of items of a leaf; 0 for an inner node.
    items: u32,
}

/// A tree over boxes, split at the median of the centres along the longest side.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    /// Indices of the boxes, leaf by leaf.
    order: Vec<u32>,
}

impl Bvh {
    pub(crate) fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            let mut order = std::mem::take(&mut tree.order);
            tree.build(boxes, &mut order, 0);
            tree.order = order;
        }
        tree
    }

    fn build(&mut self, boxes: &[Aabb], items: &mut [u32], first: usize) {
        let box_of = |item: &u32| boxes.get(*item as usize).copied().unwrap_or(Aabb::NONE);
        let bounds = items.iter().fold(Aabb::NONE, |all, item| all.joined(&box_of(item)));
        let at = self.nodes.len();
        self.nodes.push(Node { bounds, at: first as u32, items: items.len() as u32 });
        if items.len() <= LEAF_ITEMS {
            return;
        }
        let (least, most) = items
            .iter()
            .map(|item| box_of(item).middle())
            .fold((bounds.most, bounds.least), |(least, most), middle| {
                (least.inf(&middle), most.sup(&middle))
            });
        let axis = (most - least).imax();
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| {
            box_of(a).middle()[axis].total_cmp(&box_of(b).middle()[axis]).then(a.cmp(b))
        });
        let (lower, upper) = items.split_at_mut(half);
        self.build(boxes, lower, first);
        let second = self.nodes.len() as u32;
        self.build(boxes, upper, first + half);
        if let Some(node) = self.nodes.get_mut(at) {
            (node.at, node.items) = (second, 0);
        }
    }

    /// The item that the ray hits first, with its parameter. `hit` returns the parameter for an item; the nearest boxes are
    /// tested first. Of several items at the same parameter it is any one, but always the same.
    pub(crate) fn nearest(
        &self,
        ray: &Ray,
        mut hit: impl FnMut(usize) -> Option<f64>,
    ) -> Option<(usize, f64)> {
        let inverse = ray.direction.map(|component| 1.0 / component);
        let enters = |index: u32, limit: f64| {
            self.nodes.get(index as usize)?.bounds.enters(ray, &inverse, limit)
        };
        let mut best: Option<(usize, f64)> = None;
        let limit = |best: &Option<(usize, f64)>| best.map_or(f64::INFINITY, |(_, p)| p);
        let mut stack = [(0_u32, 0.0_f64); STACK];
        let mut waiting = 0;
        if let Some(enter) = enters(0, f64::INFINITY) {
            stack[0] = (0, enter);
            waiting = 1;
        }
        while waiting > 0 {
            waiting -= 1;
            let Some(&(index, enter)) = stack.get(waiting) else { break };
            if enter > limit(&best) {
                continue;
            }
            let Some(node) = self.nodes.get(index as usize) else { continue };
            if node.items > 0 {
                let leaf = node.at as usize..(node.at + node.items) as usize;
                for &item in self.order.get(leaf).unwrap_or_default() {
                    if let Some(parameter) = hit(item as usize)
                        && parameter < limit(&best)
                    {
                        best = Some((item as usize, parameter));
                    }
                }
                continue;
            }
            // The nearer child is popped first.
            let children = [index + 1, node.at].map(|child| (child, enters(child, limit(&best))));
            let [a, b] = children;
            let (far, near) = match (a.1, b.1) {
                (Some(first), Some(second)) if first > second => (a, b),
                _ => (b, a),
            };
            for (child, enter) in [far, near] {
                if let (Some(enter), Some(slot)) = (enter, stack.get_mut(waiting)) {
                    *slot = (child, enter);
                    waiting += 1;
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Shape;

    fn number() -> impl Strategy<Value = f64> {
        -5.0..5.0_f64
    }

    proptest! {
        /// The tree finds the same hits as brute force.
        #[test]
        fn the_nearest_is_that_of_all(
            places in prop::collection::vec(([number(), number(), number()], 0.05..1.0_f64), 0..60),
            from in [number(), number(), number()],
            towards in [number(), number(), number()],
            along_axis in prop::option::of(0..3_usize),
        ) {
            let boxes: Vec<Aabb> = places
                .iter()
                .map(|&(middle, radius)| {
                    let middle = Point3::from(middle);
                    let half = Vector3::repeat(radius);
                    Aabb { least: middle - half, most: middle + half }
                })
                .collect();
            let mut direction = Point3::from(towards) - Point3::from(from);
            if let Some(axis) = along_axis {
                direction = Vector3::zeros();
                direction[axis] = -1.0;
            }
            prop_assume!(direction.norm() > 1e-3);
            let ray = Ray { origin: from.into(), direction };
            let hit = |item: usize| {
                let (middle, radius_m) = places[item];
                let local = Ray { origin: ray.origin - Point3::from(middle).coords, ..ray };
                Shape::Sphere { radius_m }.intersect(&local).map(|hit| hit.parameter)
            };
            let found = Bvh::new(&boxes).nearest(&ray, hit);
            let plain = (0..places.len())
                .filter_map(|item| hit(item).map(|parameter| (item, parameter)))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            prop_assert_eq!(found, plain);
        }
    }

    #[test]
    fn many_in_one_place_are_no_trouble() {
        let same = vec![Aabb { least: Point3::origin(), most: Point3::new(1.0, 1.0, 1.0) }; 1000];
        let tree = Bvh::new(&same);
        let ray = Ray { origin: Point3::new(-1.0, 0.5, 0.5), direction: Vector3::x() };
        let mut asked = 0;
        let found = tree.nearest(&ray, |item| {
            asked += 1;
            Some(2.0 - item as f64 * 1e-3)
        });
        assert!(found.is_some_and(|(item, _)| item == 999) && asked == 1000);
        assert_eq!(Bvh::new(&[]).nearest(&ray, |_| Some(1.0)), None);
    }
}
