//! The media that rays travel in, and what happens at their boundaries.

pub(super) mod absorption;
pub(super) mod around_eye;

use super::sobol::mix;
use crate::scene::MAX_DEPTH;
use std::collections::HashMap;

/// One medium a ray is inside of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Medium {
    /// Index into the scene's materials.
    pub material: u32,
    /// Index of refraction.
    pub ior: f32,
}

/// The media a ray is inside of: a list in the [`MediaTable`] of the worker that traces it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Media(u32);

impl Media {
    /// Empty space.
    pub(crate) const OUTSIDE: Self = Self(0);
}

/// What happens to a ray at the boundary of a medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// Index of refraction on the side the ray comes from.
    pub n_i: f32,
    /// Index of refraction on the other side.
    pub n_t: f32,
    /// Media around the ray after transmission.
    pub beyond: Media,
}

impl Crossing {
    /// How many times as far as normals the directions of refracted rays turn, at near-normal incidence.
    pub(crate) fn turns(&self) -> f32 {
        (1.0 - self.n_i / self.n_t).abs()
    }
}

/// Stacks of nested media, the innermost last, stored as linked lists that share their outer parts.
///
/// After C. M. Schmidt and B. Budge, "Simple Nested Dielectrics in Ray Traced Images" (2002), where the most recently entered
/// medium takes precedence. A medium that was never entered may be left (an open mesh).
///
/// Each list is stored once: rays that have gone the same way share it.
#[derive(Debug, Default)]
pub(crate) struct MediaTable {
    lists: Vec<List>,
    /// Hash table of the lists by content, with linear probing. The number of slots is a power of two, and at most half of them
    /// are taken.
    slots: Vec<Media>,
    /// List in which rays start.
    start: Media,
    /// Buffer for the media that were entered after the one that is left.
    within: Vec<Medium>,
    /// Unused lists are kept while there are fewer lists than this.
    limit: usize,
}

/// A medium that was entered from within another list.
#[derive(Clone, Copy, Debug, PartialEq)]
struct List {
    innermost: Medium,
    outer: Media,
    len: u32,
}

impl List {
    fn hash(&self) -> usize {
        mix(mix(self.outer.0, self.innermost.material), self.innermost.ior.to_bits()) as usize
    }
}

impl MediaTable {
    /// Index of refraction of empty space.
    const EMPTY_SPACE: f32 = 1.0;
    /// Minimum number of slots of a table that is not empty.
    const LEAST: usize = 16;
    /// Maximum length of a list, so that a medium that is entered again and again and never left costs no more time each time:
    /// more than an eye may start inside of plus what its rays then enter. A medium entered beyond that is the only one.
    const MOST: u32 = 2 * MAX_DEPTH;
    /// Number of lists before unused ones are dropped.
    const MANY: usize = 1 << 14;

    /// Whether there are so many lists that it is worth dropping those that no ray uses.
    pub(crate) fn is_large(&self) -> bool {
        self.lists.len() >= self.limit.max(Self::MANY)
    }

    /// Drops all lists but those that rays use, all of which are in `held`, and the one in which rays start, whose index stays
    /// the same.
    pub(crate) fn retain<'m>(&mut self, held: impl Iterator<Item = &'m mut Media>) {
        let all = std::mem::take(self);
        // New index of each list.
        let mut renamed = HashMap::new();
        // The first list stays the first.
        self.start = self.adopt(&all, all.start, &mut renamed);
        debug_assert_eq!(self.start, all.start);
        for media in held {
            *media = self.adopt(&all, *media, &mut renamed);
        }
        self.limit = 2 * self.lists.len();
    }

    /// Copies a list from another table, with the lists it extends, unless that was done.
    fn adopt(&mut self, other: &Self, media: Media, renamed: &mut HashMap<Media, Media>) -> Media {
        let (mut missing, mut outer) = (Vec::new(), media);
        let mut made = loop {
            let Some(&list) = other.list(outer) else { break Media::OUTSIDE };
            if let Some(&made) = renamed.get(&outer) {
                break made;
            }
            missing.push((outer, list));
            outer = list.outer;
        };
        while let Some((media, list)) = missing.pop() {
            made = self.find_or_make(List { outer: made, ..list });
            renamed.insert(media, made);
        }
        made
    }

    /// Drops all lists and makes that of these media, the innermost last, in which rays start.
    pub(crate) fn reset(&mut self, start: &[Medium]) -> Media {
        if !self.lists.is_empty() {
            self.lists.clear();
            self.slots.clear();
            self.limit = 0;
        }
        self.start = start.iter().fold(Media::OUTSIDE, |media, &medium| self.enter(media, medium));
        self.start
    }

    fn list(&self, media: Media) -> Option<&List> {
        self.lists.get((media.0 as usize).checked_sub(1)?)
    }

    /// Medium that takes precedence; `None` in empty space.
    pub(crate) fn innermost(&self, media: Media) -> Option<Medium> {
        self.list(media).map(|list| list.innermost)
    }

    fn ior(&self, media: Media) -> f32 {
        self.innermost(media).map_or(Self::EMPTY_SPACE, |medium| medium.ior)
    }

    fn enter(&mut self, outer: Media, medium: Medium) -> Media {
        let outer_len = self.list(outer).map_or(0, |list| list.len);
        let (outer, len) = if outer_len < Self::MOST { (outer, outer_len + 1) } else { (Media::OUTSIDE, 1) };
        self.find_or_make(List { innermost: medium, outer, len })
    }

    fn find_or_make(&mut self, list: List) -> Media {
        if self.slots.len() <= 2 * self.lists.len() {
            self.grow();
        }
        let slot = self.slot(&list);
        if self.slots[slot] == Media::OUTSIDE {
            self.lists.push(list);
            #[expect(clippy::cast_possible_truncation, reason = "memory holds fewer")]
            let made = Media(self.lists.len() as u32);
            self.slots[slot] = made;
        }
        self.slots[slot]
    }

    /// Slot where a list is, or would be inserted.
    fn slot(&self, list: &List) -> usize {
        let last = self.slots.len() - 1;
        let mut slot = list.hash() & last;
        while self.list(self.slots[slot]).is_some_and(|other| other != list) {
            slot = (slot + 1) & last;
        }
        slot
    }

    fn grow(&mut self) {
        let slots = (4 * self.lists.len()).next_power_of_two().max(Self::LEAST);
        self.slots.clear();
        self.slots.resize(slots, Media::OUTSIDE);
        for (made, list) in (1..).zip(&self.lists) {
            let slot = self.slot(list);
            self.slots[slot] = Media(made);
        }
    }

    /// The list without the last medium of this material; `None` if it has none.
    fn leave(&mut self, media: Media, material: u32) -> Option<Media> {
        self.within.clear();
        let mut without = media;
        loop {
            let &List { innermost, outer, .. } = self.list(without)?;
            without = outer;
            if innermost.material == material {
                break;
            }
            self.within.push(innermost);
        }
        while let Some(medium) = self.within.pop() {
            without = self.enter(without, medium);
        }
        Some(without)
    }

    /// Crossing of a surface with the same medium on both sides, which rays pass straight.
    pub(crate) fn pass(&self, media: Media) -> Crossing {
        let ior = self.ior(media);
        Crossing { n_i: ior, n_t: ior, beyond: media }
    }

    /// Indices of refraction on both sides of the surface of `medium`, and the media beyond it, for a ray inside `media`.
    pub(crate) fn cross(&mut self, media: Media, medium: Medium, entering: bool) -> Crossing {
        let innermost = self.innermost(media);
        let here = innermost.map_or(Self::EMPTY_SPACE, |medium| medium.ior);
        if entering {
            return Crossing { n_i: here, n_t: medium.ior, beyond: self.enter(media, medium) };
        }
        match self.leave(media, medium.material) {
            Some(beyond) => {
                // White light that starts inside has the index of one wavelength, and is split where it leaves.
                let index = |of: Option<Medium>| match of {
                    Some(of) if of.material == medium.material => medium.ior,
                    Some(of) => of.ior,
                    None => Self::EMPTY_SPACE,
                };
                Crossing { n_i: index(innermost), n_t: index(self.innermost(beyond)), beyond }
            }
            None => Crossing { n_i: medium.ior, n_t: here, beyond: media },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    const GLASS: Medium = Medium { material: 1, ior: 1.5 };
    const WATER: Medium = Medium { material: 2, ior: 1.33 };

    fn indices(c: &Crossing) -> (f32, f32) {
        (c.n_i, c.n_t)
    }

    #[test]
    fn a_glass_of_water_is_crossed_with_the_right_indices() {
        let mut table = MediaTable::default();
        let into_glass = table.cross(Media::OUTSIDE, GLASS, true);
        let into_water = table.cross(into_glass.beyond, WATER, true);
        let out_of_water = table.cross(into_water.beyond, WATER, false);
        let out_of_glass = table.cross(out_of_water.beyond, GLASS, false);
        assert_eq!(indices(&into_glass), (1.0, 1.5));
        assert_eq!(indices(&into_water), (1.5, 1.33));
        assert_eq!(indices(&out_of_water), (1.33, 1.5));
        assert_eq!(indices(&out_of_glass), (1.5, 1.0));
        assert_eq!(out_of_glass.beyond, Media::OUTSIDE);
    }

    #[test]
    fn leaving_the_outer_of_two_overlapping_substances_bends_nothing() {
        let mut table = MediaTable::default();
        let both = table.reset(&[GLASS, WATER]);
        let out = table.cross(both, GLASS, false);
        assert_eq!(indices(&out), (1.33, 1.33));
        assert_eq!(indices(&table.cross(out.beyond, WATER, false)), (1.33, 1.0));
    }

    #[test]
    fn a_substance_that_was_never_entered_can_be_left() {
        let crossing = MediaTable::default().cross(Media::OUTSIDE, GLASS, false);
        assert_eq!((indices(&crossing), crossing.beyond), ((1.5, 1.0), Media::OUTSIDE));
    }

    #[test]
    fn what_is_entered_and_never_left_is_forgotten_some_time() {
        let mut table = MediaTable::default();
        let mut media = Media::OUTSIDE;
        let medium = |material| Medium { material, ior: 2.0 + material as f32 };
        for material in 0..5000 {
            let crossing = table.cross(media, medium(material), true);
            assert_eq!(crossing.n_t, medium(material).ior);
            assert!(table.list(crossing.beyond).is_some_and(|list| list.len <= MediaTable::MOST));
            media = crossing.beyond;
        }
        assert_eq!(table.innermost(media), Some(medium(4999)));
    }

    #[test]
    fn lists_hold_what_a_ray_has_entered_and_not_left_in_whatever_order_rays_go() {
        let (mut random, mut table) = (Random::new(6), MediaTable::default());
        let mut rays = vec![(Media::OUTSIDE, Vec::new()); 50];
        for _ in 0..20_000 {
            let at = random.below(50);
            let (media, list) = &mut rays[at];
            let (material, entering) = (random.below(12) as u32, random.below(2) == 0 && list.len() < 60);
            let medium = Medium { material, ior: 1.0 + material as f32 };
            let ior = |list: &[Medium]| list.last().map_or(1.0, |m| m.ior);
            let before = ior(list);
            let crossing = table.cross(*media, medium, entering);
            match list.iter().rposition(|m: &Medium| m.material == material) {
                _ if entering => list.push(medium),
                Some(at) => drop(list.remove(at)),
                None => assert_eq!((crossing.n_i, crossing.beyond), (medium.ior, *media)),
            }
            *media = crossing.beyond;
            assert_eq!(crossing.n_t, ior(list));
            if entering {
                assert_eq!(crossing.n_i, before);
            }
            let mut held = Vec::new();
            let mut left = *media;
            while let Some(found) = table.list(left) {
                held.push(found.innermost);
                left = found.outer;
            }
            held.reverse();
            assert_eq!(held, *list);
        }
    }

    #[test]
    fn lists_that_no_ray_holds_are_forgotten_and_the_others_stay_what_they_are() {
        let (mut random, mut table) = (Random::new(7), MediaTable::default());
        let medium = |material: usize| Medium { material: material as u32, ior: 1.5 };
        let walk = |table: &mut MediaTable, random: &mut Random| {
            let mut media = Media::OUTSIDE;
            for _ in 0..20 {
                media = table.cross(media, medium(random.below(40)), random.below(3) > 0).beyond;
            }
            media
        };
        let held = |table: &MediaTable, mut media: Media| {
            let mut all = Vec::new();
            while let Some(list) = table.list(media) {
                all.push((list.innermost, list.len));
                media = list.outer;
            }
            all
        };
        let start = table.reset(&[medium(41), medium(3), medium(41)]);
        let mut rays: Vec<Media> = (0..100).map(|_| walk(&mut table, &mut random)).collect();
        while !table.is_large() {
            walk(&mut table, &mut random);
        }
        rays.extend([Media::OUTSIDE, rays[3], start]);
        let before: Vec<_> = rays.iter().map(|&media| held(&table, media)).collect();
        table.retain(rays.iter_mut());
        assert!(table.lists.len() < 2000 && !table.is_large(), "{}", table.lists.len());
        assert!(rays.iter().map(|&media| held(&table, media)).eq(before));
        assert_eq!((rays[101], rays[102]), (rays[3], start));
        // A list that is made again is found in its old place.
        let lists = table.lists.len();
        let left = table.list(rays[5]).unwrap();
        let (innermost, outer) = (left.innermost, left.outer);
        assert_eq!((table.enter(outer, innermost), table.lists.len()), (rays[5], lists));
    }

    #[test]
    fn white_light_that_starts_inside_leaves_with_the_index_of_its_part_of_the_spectrum() {
        let mut table = MediaTable::default();
        let within = table.reset(&[WATER, GLASS]);
        let blue = Medium { ior: 1.53, ..GLASS };
        assert_eq!(indices(&table.cross(within, blue, false)), (1.53, 1.33));
        // The water around the glass is not the innermost medium.
        assert_eq!(indices(&table.cross(within, WATER, false)), (1.5, 1.5));
        // Another layer of glass around it.
        let twice = table.reset(&[GLASS, GLASS]);
        assert_eq!(indices(&table.cross(twice, blue, false)), (1.53, 1.53));
    }

    #[test]
    fn an_eye_within_very_many_bodies_starts_where_it_did_whatever_is_forgotten() {
        let mut table = MediaTable::default();
        let many: Vec<Medium> = (0..MAX_DEPTH).map(|material| Medium { material, ior: 1.5 }).collect();
        let start = table.reset(&many);
        let mut left = table.cross(start, many[700], false).beyond;
        table.retain(std::iter::once(&mut left));
        assert_eq!(table.cross(start, many[700], false).beyond, left);
        assert_eq!(table.list(start).map(|list| list.len), Some(MAX_DEPTH));
    }

    #[test]
    fn rays_that_go_the_same_way_share_their_lists() {
        let mut table = MediaTable::default();
        for _ in 0..1000 {
            let in_glass = table.cross(Media::OUTSIDE, GLASS, true).beyond;
            let in_water = table.cross(in_glass, WATER, true).beyond;
            assert_eq!(table.cross(in_water, WATER, false).beyond, in_glass);
            assert_eq!(table.pass(in_water), Crossing { n_i: 1.33, n_t: 1.33, beyond: in_water });
        }
        assert_eq!(table.lists.len(), 2);
    }
}
