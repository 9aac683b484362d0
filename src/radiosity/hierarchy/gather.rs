//! Light over the links: gathered by each node, pushed down to the patches, and pulled up again.

use super::bodies::{Body, Parts};
use super::sphere::Sphere;
use super::tree::{Gain, Kind, NONE, Tree, TreeLink, TreeNode};
use crate::math::DVec3;
use crate::radiosity::Rgb64;
use rayon::prelude::*;
use std::f64::consts::PI;

/// The light that each node sends and receives.
///
/// Steps deal with the parts of the tree that are linked; [`Field::spread`] brings the light to what is in bodies.
#[derive(Clone)]
pub struct Field {
    /// Mean over the area of each node, in W/m².
    pub radiosity: Vec<Rgb64>,
    pub irradiance: Vec<Rgb64>,
    /// What errors are judged against: the geometric mean of the irradiance of the surfaces of each node, in W/m².
    pub usual: Vec<f64>,
    /// Irradiance by patch (by node) that comes by no link; then patches do not emit. `None`: that of lights which
    /// are no patches, and patches emit.
    pub given: Option<Vec<Rgb64>>,
    /// Of the clusters, by their number: radiant intensity by direction.
    intensity: Vec<Sphere>,
    /// By body: radiant intensity, and irradiance summed over the area, without what links bring; what links bring.
    constant: Vec<(Sphere, Rgb64)>,
    arriving: Vec<Sphere>,
}

impl Field {
    /// What is emitted, and nothing else.
    pub fn new(tree: &Tree) -> Field {
        let mut field = Field::of(tree, None);
        for (b, node) in field.radiosity.iter_mut().zip(&tree.nodes) {
            *b = node.emission + node.albedo * node.unlinked();
        }
        field.pull(tree);
        field
    }

    /// What patches of `irradiance` reflect, of which `given` comes by no link (both by node); they emit nothing.
    pub fn reflected(tree: &Tree, given: Vec<Rgb64>, irradiance: Vec<Rgb64>) -> Field {
        let mut field = Field::of(tree, Some(given));
        field.irradiance = irradiance;
        for (i, node) in tree.nodes.iter().enumerate() {
            field.radiosity[i] = node.albedo * field.irradiance[i];
        }
        for &cell in &tree.cells {
            field.raise_surface(tree, cell);
        }
        field.pull(tree);
        field
    }

    fn of(tree: &Tree, given: Option<Vec<Rgb64>>) -> Field {
        Field {
            radiosity: vec![Rgb64::ZERO; tree.nodes.len()],
            irradiance: vec![Rgb64::ZERO; tree.nodes.len()],
            usual: Vec::new(),
            given,
            intensity: Vec::new(),
            constant: Vec::new(),
            arriving: Vec::new(),
        }
    }

    /// The same radiosity everywhere, 1 W/m².
    pub fn uniform(tree: &Tree) -> Field {
        let mut field = Field::of(tree, None);
        field.radiosity.fill(Rgb64::ONE);
        field.pull(tree);
        field
    }

    /// Only what patches emit.
    pub fn of_emission(tree: &Tree) -> Field {
        let mut field = Field::of(tree, None);
        for (b, node) in field.radiosity.iter_mut().zip(&tree.nodes) {
            *b = node.emission;
        }
        field.pull(tree);
        field
    }

    /// Irradiance of a patch that comes by no link.
    fn apart(&self, tree: &Tree, leaf: u32) -> Rgb64 {
        match &self.given {
            Some(given) => given[leaf as usize],
            None => tree.nodes[leaf as usize].unlinked(),
        }
    }

    /// Radiosity of a patch of known irradiance.
    fn sent(&self, node: &TreeNode, irradiance: Rgb64) -> Rgb64 {
        let reflected = node.albedo * irradiance;
        match self.given {
            Some(_) => reflected,
            None => node.emission + reflected,
        }
    }

    /// To be called when the parts or the given irradiance are new.
    pub fn prepare(&mut self, tree: &Tree, parts: &Parts) {
        /// Leaves of one task.
        const CHUNK: usize = 4096;
        let of = |leaves: &[u32]| {
            let mut sum = (Sphere::default(), Rgb64::ZERO);
            for &leaf in leaves {
                let node = &tree.nodes[leaf as usize];
                let irradiance = self.apart(tree, leaf);
                let sent = self.sent(node, irradiance);
                sum.0.add_surface(sent, node.area, node.normal);
                sum.1 += irradiance * node.area;
            }
            sum
        };
        let mut constant = Vec::with_capacity(parts.bodies.len());
        for body in &parts.bodies {
            let leaves = &parts.leaves[body.leaves.clone()];
            let sums: Vec<_> = leaves.par_chunks(CHUNK).map(of).collect();
            let mut all = (Sphere::default(), Rgb64::ZERO);
            for (sphere, sum) in &sums {
                all.0.add(sphere);
                all.1 += *sum;
            }
            constant.push(all);
        }
        self.constant = constant;
        self.arriving = vec![Sphere::default(); parts.bodies.len()];
    }

    /// Gives nodes that are new the light of their parents; what they emit and reflect differently counts.
    pub fn grow(&mut self, tree: &Tree) {
        for i in self.radiosity.len()..tree.nodes.len() {
            let node = &tree.nodes[i];
            let parent = &tree.nodes[node.parent as usize];
            let irradiance = self.irradiance[node.parent as usize];
            let same = node.albedo == parent.albedo && node.emission == parent.emission;
            self.radiosity.push(match same {
                true => self.radiosity[node.parent as usize],
                false => node.emission + node.albedo * irradiance.max(node.unlinked()),
            });
            self.irradiance.push(irradiance);
            let usual = self.usual[node.parent as usize];
            self.usual.push(usual);
        }
    }

    /// Takes the light that there is as what errors are judged against.
    /// What is darker than `black`, as a share of the mean, counts as that dark.
    pub fn judge_by(&mut self, tree: &Tree, black: f64) {
        /// Share of the light that counts as arriving even if links bring less: all may come through glass.
        const LEAST: f64 = 0.1;
        let given = tree.emitted_power().max_element() / tree.nodes[0].area;
        let mean = self.irradiance[0].max_element();
        if mean.is_nan() || mean <= 0.0 {
            self.usual = vec![self.radiosity[0].max_element(); tree.nodes.len()];
            return;
        }
        let mean = mean.max(LEAST * given);
        // Means of logarithms, pulled up from the patches.
        let floor = |e: Rgb64| e.max_element().max(black * mean).ln();
        let mut logs: Vec<f64> = self.irradiance.iter().map(|e| floor(*e)).collect();
        for &i in tree.by_cluster.iter().rev() {
            let i = i as usize;
            let node = &tree.nodes[i];
            if node.area > 0.0 {
                let inside = tree.children(i as u32).map(|c| c as usize);
                let sum: f64 = inside.map(|c| logs[c] * tree.nodes[c].area).sum();
                logs[i] = sum / node.area;
            }
        }
        self.usual = logs.into_iter().map(f64::exp).collect();
    }

    /// All nodes gather what the others send. Gives Σ A |ΔB| over patches and bodies, summed over the channels, in W.
    pub fn step(&mut self, tree: &Tree, parts: &Parts) -> f64 {
        let linked = self.gather(tree, parts);
        self.apply(tree, parts, &linked)
    }

    /// What links bring: kept for the bodies, given for the patches of all other cells, in W/m².
    pub fn gather(&mut self, tree: &Tree, parts: &Parts) -> Vec<Vec<(u32, Rgb64)>> {
        /// Cells that one task gathers for.
        const CHUNK: usize = 64;
        let around = self.around_clusters(tree, parts);
        let gather = |cells: &[u32]| {
            let mut found = Vec::with_capacity(2 * cells.len());
            for &cell in cells {
                let node = &tree.nodes[cell as usize];
                let above = match tree.clusters.get(node.parent as usize) {
                    Some(&number) => around[number as usize].irradiance(node.normal),
                    None => Rgb64::ZERO,
                };
                self.push(tree, cell, above, &mut found);
            }
            found
        };
        let linked = parts.cells.par_chunks(CHUNK).map(gather).collect();
        let arriving = |body: &Body| around[tree.clusters[body.node as usize] as usize];
        self.arriving = parts.bodies.iter().map(arriving).collect();
        linked
    }

    /// Takes over what links bring, as the gains of nodes make it.
    pub fn apply(&mut self, tree: &Tree, parts: &Parts, linked: &[Vec<(u32, Rgb64)>]) -> f64 {
        let mut change = 0.0;
        for &(leaf, linked) in linked.iter().flatten() {
            let (i, node) = (leaf as usize, &tree.nodes[leaf as usize]);
            let irradiance = self.apart(tree, leaf) + node.gain.of(linked);
            let radiosity = self.sent(node, irradiance);
            change += (radiosity - self.radiosity[i]).abs().element_sum() * node.area;
            (self.radiosity[i], self.irradiance[i]) = (radiosity, irradiance);
        }
        for (number, body) in parts.bodies.iter().enumerate() {
            let (i, node) = (body.node as usize, &tree.nodes[body.node as usize]);
            let (constant, received) = &self.constant[number];
            let (gain, arriving) = (&node.gain, &self.arriving[number]);
            let mut sent = body.reflect(arriving);
            sent.scale(gain.scale);
            let mut more = body.reflects;
            more.scale(gain.more);
            sent.add(&more);
            sent.add(constant);
            sent.keep_positive();
            let share = if node.area > 0.0 {
                1.0 / node.area
            } else {
                0.0
            };
            let radiosity = sent.power() * share;
            change += (radiosity - self.radiosity[i]).abs().element_sum() * node.area;
            self.radiosity[i] = radiosity;
            self.irradiance[i] =
                (*received + gain.scale * body.received(arriving)) * share + gain.more;
            self.intensity[tree.clusters[i] as usize] = sent;
        }
        self.raise(tree, parts);
        change
    }

    /// Means of what is divided, and of clusters, by what they contain.
    fn raise(&mut self, tree: &Tree, parts: &Parts) {
        for &cell in &parts.cells {
            self.raise_surface(tree, cell);
        }
        for &cluster in parts.open.iter().rev() {
            let mut sum = self.of_surfaces(tree, cluster);
            for child in tree.children(cluster) {
                let Some(&number) = tree.clusters.get(child as usize).filter(|n| **n != NONE)
                else {
                    continue;
                };
                let (i, area) = (child as usize, tree.nodes[child as usize].area);
                sum.power += self.radiosity[i] * area;
                sum.arriving += self.irradiance[i] * area;
                sum.intensity.add(&self.intensity[number as usize]);
            }
            self.take(tree, cluster, sum);
        }
    }

    /// Means over the quarters of a surface, if it has any.
    fn raise_surface(&mut self, tree: &Tree, node: u32) {
        let first = tree.nodes[node as usize].quarters;
        if first == NONE {
            return;
        }
        let mut mean = (Rgb64::ZERO, Rgb64::ZERO);
        for quarter in first..first + 4 {
            self.raise_surface(tree, quarter);
            mean.0 += self.radiosity[quarter as usize] * 0.25;
            mean.1 += self.irradiance[quarter as usize] * 0.25;
        }
        (
            self.radiosity[node as usize],
            self.irradiance[node as usize],
        ) = mean;
    }

    fn take(&mut self, tree: &Tree, cluster: u32, sum: Sum) {
        let (i, node) = (cluster as usize, &tree.nodes[cluster as usize]);
        let share = if node.area > 0.0 {
            1.0 / node.area
        } else {
            0.0
        };
        self.radiosity[i] = sum.power * share;
        self.irradiance[i] = sum.arriving * share;
        self.intensity[tree.clusters[i] as usize] = sum.intensity;
    }

    /// Adds what patches emit to what they send.
    pub fn emit(&mut self, tree: &Tree) {
        for (b, node) in self.radiosity.iter_mut().zip(&tree.nodes) {
            *b += node.emission;
        }
    }

    /// What links bring to a body, as the mean over its area.
    pub fn linked_to_body(&self, tree: &Tree, body: &Body, number: usize) -> Rgb64 {
        let area = tree.nodes[body.node as usize].area;
        match area > 0.0 {
            true => body.received(&self.arriving[number]) / area,
            false => Rgb64::ZERO,
        }
    }

    /// What links bring to a patch in a body.
    pub fn linked_in_body(&self, tree: &Tree, parts: &Parts, leaf: u32) -> Rgb64 {
        let body = parts.body_of[leaf as usize];
        self.arriving[body as usize].irradiance(tree.nodes[leaf as usize].normal)
    }

    /// Irradiance of a patch in a body, by the gain of the body.
    pub fn irradiance_in_body(&self, tree: &Tree, parts: &Parts, leaf: u32) -> Rgb64 {
        let body = &parts.bodies[parts.body_of[leaf as usize] as usize];
        let gain = &tree.nodes[body.node as usize].gain;
        self.apart(tree, leaf) + gain.of(self.linked_in_body(tree, parts, leaf))
    }

    /// Brings the light that arrives at bodies to their patches, and up again; by the gains of bodies, or by `gains` of
    /// the patches (by node).
    pub fn spread(&mut self, tree: &Tree, parts: &Parts, gains: Option<&[Gain]>) {
        let of = |&leaf: &u32| match gains {
            None => self.irradiance_in_body(tree, parts, leaf),
            Some(gains) => {
                let linked = self.linked_in_body(tree, parts, leaf);
                self.apart(tree, leaf) + gains[leaf as usize].of(linked)
            }
        };
        let irradiance: Vec<Rgb64> = parts.leaves.par_iter().map(of).collect();
        for (&leaf, irradiance) in parts.leaves.iter().zip(irradiance) {
            let i = leaf as usize;
            self.radiosity[i] = self.sent(&tree.nodes[i], irradiance);
            self.irradiance[i] = irradiance;
        }
        for i in (0..tree.nodes.len() as u32).rev() {
            let node = &tree.nodes[i as usize];
            let is_cell = |parent: u32| tree.nodes[parent as usize].is_cluster();
            if parts.body_of[i as usize] != NONE && node.quarters != NONE && is_cell(node.parent) {
                self.raise_surface(tree, i);
            }
        }
        self.pull(tree);
    }

    /// The light that arrives at each cluster by its links and those of the clusters around it.
    fn around_clusters(&self, tree: &Tree, parts: &Parts) -> Vec<Sphere> {
        let own = |node: u32| {
            let node = &tree.nodes[node as usize];
            let mut sum = Sphere::default();
            for link in &node.links {
                self.add_arriving(tree, node, link, &mut sum);
            }
            sum
        };
        let bodies = parts.bodies.iter().map(|body| body.node);
        let clusters: Vec<u32> = parts.open.iter().copied().chain(bodies).collect();
        let found: Vec<Sphere> = clusters.par_iter().map(|&node| own(node)).collect();
        let mut around = vec![Sphere::default(); tree.by_cluster.len()];
        // Clusters come before what they contain.
        for (&node, mut sum) in clusters.iter().zip(found) {
            let parent = tree.nodes[node as usize].parent;
            if let Some(&above) = tree.clusters.get(parent as usize) {
                sum.add(&around[above as usize]);
            }
            around[tree.clusters[node as usize] as usize] = sum;
        }
        around
    }

    /// What a link brings to a cluster.
    fn add_arriving(&self, tree: &Tree, receiver: &TreeNode, link: &TreeLink, sum: &mut Sphere) {
        let sender = &tree.nodes[link.sender as usize];
        let d = sender.center - receiver.center;
        let distance = d.length();
        if distance <= receiver.radius + sender.radius {
            // From no direction in particular.
            let radiance = self.radiosity[link.sender as usize] * f64::from(link.form_factor) / PI;
            return sum.add_everywhere(radiance);
        }
        let towards = d / distance;
        let flux = self.sent_towards(tree, link.sender, -towards);
        sum.add_from(
            towards,
            flux * (f64::from(link.visible) / (distance * distance)),
        );
    }

    /// Radiant intensity of a node in W/sr towards the unit vector `d`.
    fn sent_towards(&self, tree: &Tree, sender: u32, d: DVec3) -> Rgb64 {
        let node = &tree.nodes[sender as usize];
        match node.kind {
            Kind::Surface { .. } => {
                let cos = d.dot(node.normal).max(0.0);
                self.radiosity[sender as usize] * (node.area * cos / PI)
            }
            Kind::Cluster { .. } => {
                self.intensity[tree.clusters[sender as usize] as usize].towards(d)
            }
        }
    }

    /// Irradiance of a surface by a link.
    fn received(&self, tree: &Tree, receiver: &TreeNode, link: &TreeLink) -> Rgb64 {
        let sender = &tree.nodes[link.sender as usize];
        let d = sender.center - receiver.center;
        let distance = d.length();
        let by_factor = !sender.is_cluster() || distance <= receiver.radius + sender.radius;
        if by_factor {
            return self.radiosity[link.sender as usize] * f64::from(link.form_factor);
        }
        let towards = d / distance;
        let cos = towards.dot(receiver.normal).max(0.0);
        let flux = self.sent_towards(tree, link.sender, -towards);
        flux * (cos * f64::from(link.visible) / (distance * distance))
    }

    /// Brings light to the patches below `node`.
    fn push(&self, tree: &Tree, node: u32, above: Rgb64, found: &mut Vec<(u32, Rgb64)>) {
        let n = &tree.nodes[node as usize];
        let mut gathered = above;
        for link in &n.links {
            gathered += self.received(tree, n, link);
        }
        match n.quarters {
            NONE => found.push((node, gathered)),
            first => (first..first + 4).for_each(|q| self.push(tree, q, gathered, found)),
        }
    }

    /// Means and intensities of the clusters, by what they contain.
    fn pull(&mut self, tree: &Tree) {
        let own = |&cluster: &u32| self.of_surfaces(tree, cluster);
        let mut sums: Vec<Sum> = tree.by_cluster.par_iter().map(own).collect();
        // Clusters come before what they contain.
        for (number, &i) in tree.by_cluster.iter().enumerate().rev() {
            let node = &tree.nodes[i as usize];
            let sum = sums[number];
            if let Some(&above) = tree.clusters.get(node.parent as usize) {
                let above = &mut sums[above as usize];
                above.power += sum.power;
                above.arriving += sum.arriving;
                above.intensity.add(&sum.intensity);
            }
            let share = if node.area > 0.0 {
                1.0 / node.area
            } else {
                0.0
            };
            self.radiosity[i as usize] = sum.power * share;
            self.irradiance[i as usize] = sum.arriving * share;
        }
        self.intensity = sums.into_iter().map(|sum| sum.intensity).collect();
    }

    /// What the surfaces directly in a cluster send and get.
    fn of_surfaces(&self, tree: &Tree, cluster: u32) -> Sum {
        let mut sum = Sum::default();
        for child in tree.children(cluster).map(|c| c as usize) {
            let inside = &tree.nodes[child];
            if inside.is_cluster() {
                continue;
            }
            sum.power += self.radiosity[child] * inside.area;
            sum.arriving += self.irradiance[child] * inside.area;
            sum.intensity
                .add_surface(self.radiosity[child], inside.area, inside.normal);
        }
        sum
    }
}

/// Of all that is in a cluster.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// In W, sent and received.
    power: Rgb64,
    arriving: Rgb64,
    intensity: Sphere,
}
