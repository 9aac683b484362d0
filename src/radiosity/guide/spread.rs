//! Densities over the patches, numbered depth first, as steps: the same for all power within a range of patches.
//!
//! A link that brings light from a cluster is one step, since a cluster's patches are a range. What many receivers
//! see, blurred over them, is a sum of such, and again steps.

use crate::radiosity::Hierarchy;
use crate::radiosity::hierarchy::{Link, Node};
use std::ops::Range;

/// A range of patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub first: u32,
    pub end: u32,
    /// Probability per power, in 1/W.
    pub density: f64,
}

/// What a sum of steps leaves by rounding, as a share of the greatest value that it had: far above the 2^-53 of
/// each of thousands of additions, far below what is worth an aim.
const ROUNDING: f64 = 1e-10;

/// Sums of powers of patches.
#[derive(Clone, Debug)]
pub struct Prefix(Vec<f64>);

impl Prefix {
    pub fn new(values: impl Iterator<Item = f64>) -> Prefix {
        let mut sum = 0.0;
        let behind = values.map(|value| {
            sum += value;
            sum
        });
        Prefix([0.0].into_iter().chain(behind).collect())
    }

    /// Sum over a range.
    #[inline]
    pub fn over(&self, first: u32, end: u32) -> f64 {
        self.0[end as usize] - self.0[first as usize]
    }

    /// Sum of all.
    pub fn whole(&self) -> f64 {
        self.0[self.0.len() - 1]
    }

    /// The number in `first..end` at which the sum from `first` on passes `sum`, never one that adds nothing,
    /// unless all do.
    #[inline]
    pub fn find(&self, first: u32, end: u32, sum: f64) -> u32 {
        let sums = &self.0[first as usize..=end as usize];
        // The last that adds anything, if rounding went beyond.
        let sum = (sums[0] + sum).min(sums[sums.len() - 1].next_down());
        let behind = sums.partition_point(|s| *s <= sum).saturating_sub(1);
        (first + behind as u32).min(end - 1)
    }
}

/// The sum of `parts`, each with its factor.
pub fn sum<'a>(parts: impl Iterator<Item = (&'a [Step], f64)>) -> Vec<Step> {
    let mut edges = Vec::new();
    for (steps, factor) in parts {
        for step in steps {
            edges.push((step.first, step.density * factor));
            edges.push((step.end, -step.density * factor));
        }
    }
    of_edges(edges)
}

/// Steps between places where the density changes by something.
fn of_edges(mut edges: Vec<(u32, f64)>) -> Vec<Step> {
    // Equal places keep their order, so that the sum is the same every time.
    edges.sort_by_key(|edge| edge.0);
    let mut steps = Vec::with_capacity(edges.len() / 2);
    let (mut density, mut greatest) = (0.0_f64, 0.0_f64);
    let mut first = 0;
    for (at, change) in edges {
        if at > first && density > greatest * ROUNDING {
            steps.push(Step {
                first,
                end: at,
                density,
            });
        }
        first = at;
        density += change;
        greatest = greatest.max(density);
    }
    steps
}

/// What is probable in all `steps` together.
pub fn mass(steps: &[Step], power: &Prefix) -> f64 {
    let of = |s: &Step| s.density * power.over(s.first, s.end);
    steps.iter().map(of).sum()
}

/// `steps` of sum 1 without those that have no power, and with neighbours joined that are less probable than `least`
/// together.
pub fn joined(steps: &[Step], power: &Prefix, least: f64) -> Vec<Step> {
    let whole = mass(steps, power);
    let mut out: Vec<Step> = Vec::new();
    // Of the last step.
    let mut last = 0.0;
    for step in steps {
        let part = step.density * power.over(step.first, step.end) / whole;
        let usable = part > 0.0 && part.is_finite();
        if !usable {
            continue;
        }
        if let Some(before) = out.last_mut() {
            let gap = power.over(before.end, step.first);
            let both = power.over(before.first, step.end);
            // What lies between must not take most of it.
            if last + part < least && gap <= 0.5 * both {
                last += part;
                before.end = step.end;
                before.density = last / both;
                continue;
            }
        }
        out.push(Step {
            density: step.density / whole,
            ..*step
        });
        last = part;
    }
    out
}

/// Where the light of each patch comes from.
pub struct Senders<'a> {
    hierarchy: &'a Hierarchy,
    /// By link: a step whose density is the irradiance per power of the sender, in 1/m².
    links: Vec<Step>,
    /// Of each patch: what its light counts for in sums, area over irradiance, so that patches of equal areas count
    /// for the same.
    counts: Prefix,
    /// Children of each node: `children[first_child[i]..first_child[i + 1]]`.
    first_child: Vec<u32>,
    children: Vec<u32>,
}

impl<'a> Senders<'a> {
    /// `area` in squared scene units, `power` in W.
    pub fn new(hierarchy: &'a Hierarchy, area: &Prefix, power: &Prefix) -> Senders<'a> {
        let step = |link: &Link| {
            let from = &hierarchy.nodes[link.sender as usize].patches;
            let per_power = f64::from(link.form_factor) / area.over(from.start, from.end);
            Step {
                first: from.start,
                end: from.end,
                density: positive(per_power),
            }
        };
        let links: Vec<Step> = hierarchy.links.iter().map(step).collect();
        let nodes = &hierarchy.nodes;
        // Irradiance by links of a node and all above, in W/m². Parents have smaller numbers.
        let mut totals = Vec::<f64>::with_capacity(nodes.len());
        let mut first_child = vec![0_u32; nodes.len() + 1];
        for node in nodes {
            let own = mass(
                &links[node.links.start as usize..node.links.end as usize],
                power,
            );
            let above = totals.get(node.parent as usize).copied().unwrap_or(0.0);
            totals.push(positive(own) + above);
            if let Some(count) = first_child.get_mut(node.parent as usize + 1) {
                *count += 1;
            }
        }
        for i in 0..nodes.len() {
            first_child[i + 1] += first_child[i];
        }
        let mut next = first_child.clone();
        let mut children = vec![0; first_child[nodes.len()] as usize];
        for (i, node) in nodes.iter().enumerate() {
            if let Some(slot) = next.get_mut(node.parent as usize)
                && (node.parent as usize) < nodes.len()
            {
                children[*slot as usize] = i as u32;
                *slot += 1;
            }
        }
        let count = |(i, &leaf): (usize, &u32)| {
            positive(area.over(i as u32, i as u32 + 1) / totals[leaf as usize])
        };
        for i in 0..nodes.len() {
            let of = first_child[i] as usize..first_child[i + 1] as usize;
            children[of].sort_by_key(|&c: &u32| nodes[c as usize].patches.start);
        }
        Senders {
            counts: Prefix::new(hierarchy.leaf.iter().enumerate().map(count)),
            hierarchy,
            links,
            first_child,
            children,
        }
    }

    /// What lights the patches in `range`: the sum of the distributions of each, by area.
    pub fn of(&self, range: &Range<u32>) -> Vec<Step> {
        let nodes = &self.hierarchy.nodes;
        let mut parts = Vec::new();
        let mut stack = vec![0];
        while let Some(number) = stack.pop() {
            let Node { patches, links, .. } = &nodes[number as usize];
            let (first, end) = (patches.start.max(range.start), patches.end.min(range.end));
            let count = if first < end {
                self.counts.over(first, end)
            } else {
                0.0
            };
            if count == 0.0 {
                continue;
            }
            let links = &self.links[links.start as usize..links.end as usize];
            parts.push((links, count));
            let children = self.children(number);
            let begin = children.partition_point(|&c| nodes[c as usize].patches.end <= first);
            let inside = |&&c: &&u32| nodes[c as usize].patches.start < end;
            stack.extend(children[begin..].iter().take_while(inside));
        }
        sum(parts.into_iter())
    }

    fn children(&self, node: u32) -> &[u32] {
        let [first, end] = [node, node + 1].map(|i| self.first_child[i as usize] as usize);
        &self.children[first..end]
    }

    /// Ranges of neighbouring patches, each no larger than `most` in area, but for single patches.
    pub fn regions(&self, area: &Prefix, most: f64) -> Vec<Range<u32>> {
        let nodes = &self.hierarchy.nodes;
        let mut out: Vec<Range<u32>> = Vec::new();
        // The parent of what the last range is made of.
        let mut of = u32::MAX;
        let mut stack = vec![0];
        while let Some(number) = stack.pop() {
            let Node {
                patches, parent, ..
            } = &nodes[number as usize];
            if patches.is_empty() {
                continue;
            }
            let children = self.children(number);
            let large = area.over(patches.start, patches.end) > most;
            if large && !children.is_empty() {
                stack.extend(children.iter().rev());
                continue;
            }
            match out.last_mut() {
                Some(last) if of == *parent && area.over(last.start, patches.end) <= most => {
                    last.end = patches.end;
                }
                _ => out.push(patches.clone()),
            }
            of = *parent;
        }
        out
    }
}

pub fn positive(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(first: u32, end: u32, density: f64) -> Step {
        Step {
            first,
            end,
            density,
        }
    }

    #[test]
    fn sums_of_nested_steps_are_steps() {
        let (a, b) = ([step(0, 4, 1.0), step(6, 8, 2.0)], [step(1, 2, 3.0)]);
        let both = sum([(&a[..], 1.0), (&b[..], 2.0)].into_iter());
        let expected = [
            step(0, 1, 1.0),
            step(1, 2, 7.0),
            step(2, 4, 1.0),
            step(6, 8, 2.0),
        ];
        assert_eq!(both, expected);
    }

    #[test]
    fn joining_keeps_what_is_probable() {
        let power = Prefix::new((0..100).map(|i| f64::from(i % 7)));
        let steps: Vec<Step> = (0..50)
            .map(|i| step(2 * i, 2 * i + 1 + i % 2, f64::from(1 + i % 5)))
            .collect();
        for least in [0.0, 0.05, 0.3, 2.0] {
            let joined = joined(&steps, &power, least);
            assert!((mass(&joined, &power) - 1.0).abs() < 1e-12, "{least}");
            assert!(joined.is_sorted_by(|a, b| a.end <= b.first));
            // Two neighbours are at least so probable, unless a gap keeps them apart.
            assert!(least == 0.0 || joined.len() as f64 <= 2.0 / least + 30.0);
        }
    }

    #[test]
    fn sums_are_found_again() {
        let values = [0.0, 1.0, 0.0, 2.0, 1.0, 0.0];
        let prefix = Prefix::new(values.into_iter());
        let found = [0.0, 0.5, 1.0, 2.9, 3.0, 3.9, 4.0, 9.0].map(|sum| prefix.find(0, 6, sum));
        assert_eq!(found, [1, 1, 3, 3, 4, 4, 4, 4]);
    }
}
