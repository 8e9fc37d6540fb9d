//! Picture of one ray: the scene cut open along it and seen from the side, with the boxes that the ray visited.
//!
//! An orthographic camera looks at the ray from the side. Its rays start on the plane through the ray, so that nothing occludes
//! it. The left view shows the whole scene, the right one the surroundings of the ray's end.

use super::TraceReport;
use super::words::{in_world, inside};
use crate::accel::probe::{Extent, Outcome, Visit};
use crate::accel::{AccelChoice, AccelKind, AccelParams};
use crate::image::draw::{Canvas, Color, text_height, text_width};
use crate::math::{DVec2, DVec3};
use crate::number::grouped;
use crate::render::ray_tree::{Class, Event, Query};
use crate::render::view::Lens;
use crate::render::{Job, Question, Settings, View, render};
use crate::scene::UpAxis;

/// Width and height of each of the two views, in pixels.
const SIDE: u32 = 640;
/// Gap between the views and around the legend.
const GAP: u32 = 12;
/// Size of the letters.
const DOT: u32 = 2;

const PAPER: Color = [20, 22, 26];
const INK: Color = [235, 235, 235];
const RAY: Color = [255, 255, 255];
const INNER: Color = [140, 145, 155];
// M. Okabe and K. Ito's colours, distinguishable with any kind of colour vision.
const EMPTY: Color = [86, 180, 233];
const TESTED: Color = [230, 159, 0];
const HIT: Color = [213, 94, 0];
const SHADOW: Color = [240, 228, 66];
const REFLECTED: Color = [0, 158, 115];
const REFRACTED: Color = [204, 121, 167];

/// Draws both views and a legend.
pub(super) fn draw(told: &TraceReport, job: &Job) -> Canvas {
    let Some(eye) = told.ray_tree.queries.first() else { return Canvas::filled(1, 1, PAPER) };
    // Backdrop by the default structure, whatever the ray went through: all give the same picture, and this one is fast.
    let (accel, _) = told.world.structure(AccelChoice::Kind(AccelKind::DEFAULT), &AccelParams::DEFAULT);
    let job = &Job { accel: &accel, ..*job };
    let stage = Stage::new(told, eye);
    let legend = stage.legend();
    let line = text_height(DOT) + 8;
    let rows = u32::try_from(legend.len().div_ceil(2)).unwrap_or(0);
    let mut canvas = Canvas::filled(2 * SIDE + 3 * GAP, SIDE + 3 * GAP + (rows + 2) * line, PAPER);
    let (whole, near) = (stage.whole(), stage.near());
    let [which, what] = stage.title();
    canvas.write(GAP, GAP, &which, DOT, INK);
    canvas.write(GAP, GAP + line, &what, DOT, INK);
    let top = GAP + 2 * line;
    canvas.paste(&stage.panel(job, whole, Some(near)), GAP, top);
    canvas.paste(&stage.panel(job, near, None), 2 * GAP + SIDE, top);
    for (i, (color, text)) in (0..).zip(&legend) {
        let (x, y) = (GAP + (i % 2) * (SIDE + GAP), top + SIDE + GAP + i / 2 * line);
        canvas.fill(x, y + 2, 28, 12, *color);
        canvas.write(x + 40, y, text, DOT, INK);
    }
    canvas
}

/// Role of a node or cell for the ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    /// Inner node.
    Inner,
    /// Leaf without prims.
    Empty,
    /// Leaf whose prims were tested.
    Tested,
    /// Leaf in which the hit was found.
    Hit,
}

impl Part {
    const ALL: [Self; 4] = [Self::Inner, Self::Empty, Self::Tested, Self::Hit];

    const fn color(self) -> Color {
        match self {
            Self::Inner => INNER,
            Self::Empty => EMPTY,
            Self::Tested => TESTED,
            Self::Hit => HIT,
        }
    }
}

/// All visits, with their roles.
fn parts(eye: &Query) -> Vec<(Visit, Part)> {
    let mut parts: Vec<(Visit, Part)> = Vec::new();
    let mut found = None;
    for event in &eye.events {
        match event {
            Event::Visit(visit) => {
                let part = match visit.listed {
                    None => Part::Inner,
                    Some(0) => Part::Empty,
                    Some(_) => Part::Tested,
                };
                parts.push((*visit, part));
            }
            Event::Test(test) if test.outcome == Outcome::Hit && test.prim == eye.hit.prim => {
                found = parts.len().checked_sub(1);
            }
            _ => {}
        }
    }
    if let Some((_, part)) = found.and_then(|i| parts.get_mut(i)) {
        *part = Part::Hit;
    }
    parts
}

/// The ray and the camera that shows it.
struct Stage<'a> {
    told: &'a TraceReport<'a>,
    eye: &'a Query,
    parts: Vec<(Visit, Part)>,
    /// Ends of the ray as drawn, in world space.
    ends: (DVec3, DVec3),
    /// Bounding box of the scene.
    scene: (DVec3, DVec3),
    view: View,
}

/// Square window of the image plane, in world units.
#[derive(Clone, Copy, Debug)]
struct Window {
    middle: DVec2,
    half: f64,
}

impl<'a> Stage<'a> {
    fn new(told: &'a TraceReport<'a>, eye: &'a Query) -> Self {
        let origin = in_world(told.world, eye.ray.origin);
        let dir = eye.ray.dir.as_dvec3();
        let parts = parts(eye);
        let scene = match told.world.bounds {
            (lo, hi) if lo.cmple(hi).all() => (lo, hi),
            _ => (origin, origin + dir),
        };

        // The ray is drawn from somewhat before the first box to the hit, or to the exit from the last box.
        let across = (scene.1 - scene.0).length() / dir.length();
        let spans = || parts.iter().filter_map(|(visit, _)| inside(&visit.extent, &eye.ray));
        let middle = ((scene.0 + scene.1) * 0.5 - origin).dot(dir) / dir.length_squared();
        let enters = spans().map(|s| s.0).fold(f64::INFINITY, f64::min).min(middle);
        let leaves = spans().map(|s| s.1).fold(middle, f64::max);
        let end = if eye.hit.is_some() { f64::from(eye.hit.t) } else { leaves };
        let start = (enters.min(end) - 0.15 * across).max(0.0);
        let ends = (origin + dir * start, origin + dir * end);

        // Look across the ray, as upright as possible, from the side on which less of the scene would be cut off.
        let up = if told.loaded.scene.up == UpAxis::Z { DVec3::Z } else { DVec3::Y };
        let across_ray = |up: DVec3| {
            let side = up.cross(dir);
            (side.length() > 1e-3 * dir.length()).then(|| side.normalize())
        };
        let forward = across_ray(up).or_else(|| across_ray(DVec3::X)).unwrap_or(DVec3::Z);
        let is_behind = ((scene.0 + scene.1) * 0.5 - ends.1).dot(forward) >= 0.0;
        let forward = if is_behind { forward } else { -forward };
        let view = View::look_along(ends.1, forward, up, Lens::orthographic(2.0));
        Self { told, eye, parts, ends, scene, view }
    }

    /// Projects a point to the image plane, in world units from the end of the ray.
    fn flat(&self, point: DVec3) -> DVec2 {
        let p = self.view.project(point);
        DVec2::new(p.x, p.y)
    }

    fn corners(&self, visit: &Visit) -> [DVec3; 8] {
        let bounds = visit.extent.bounds();
        corners((in_world(self.told.world, bounds.lo), in_world(self.told.world, bounds.hi)))
    }

    /// Window of the whole scene, and the part of the ray before it.
    fn whole(&self) -> Window {
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for point in corners(self.scene).into_iter().chain([self.ends.0, self.ends.1]) {
            lo = lo.min(self.flat(point));
            hi = hi.max(self.flat(point));
        }
        Window { middle: (lo + hi) * 0.5, half: (0.52 * (hi - lo).max_element()).max(1e-30) }
    }

    /// Window of the last leaves before the end of the ray, with a margin.
    fn near(&self) -> Window {
        let all = self.whole();
        let leaves = self.parts.iter().rev().filter(|(_, part)| *part != Part::Inner).take(4);
        let far = |corner: DVec3| self.flat(corner).abs().max_element();
        let reach = leaves.flat_map(|(visit, _)| self.corners(visit)).map(far).fold(0.0, f64::max);
        let half = if reach > 0.0 { 1.2 * reach } else { all.half };
        Window { middle: DVec2::ZERO, half: half.clamp(all.half / 1000.0, all.half / 3.0) }
    }

    /// Draws the scene behind the plane of the ray, and everything over it; `frame` is outlined.
    fn panel(&self, job: &Job, window: Window, frame: Option<Window>) -> Canvas {
        let mut canvas = self.backdrop(job, window);
        let place = |point: DVec2| {
            let p = (point - window.middle) / window.half;
            (DVec2::new(p.x, -p.y) + 1.0) * 0.5 * f64::from(SIDE)
        };
        let at = |point: DVec3| place(self.flat(point));
        for part in Part::ALL {
            let (width, opacity) = match part {
                Part::Inner => (1.0, 0.5),
                Part::Empty | Part::Tested => (1.3, 0.9),
                Part::Hit => (2.6, 1.0),
            };
            for (visit, _) in self.parts.iter().filter(|(_, p)| *p == part) {
                for [a, b] in self.outline(visit) {
                    canvas.line(at(a), at(b), width, part.color(), opacity);
                }
            }
        }
        for (color, [a, b]) in self.secondary() {
            canvas.line(at(a), at(b), 1.6, color, 0.9);
        }
        canvas.line(at(self.ends.0), at(self.ends.1), 2.6, RAY, 1.0);
        self.number(&mut canvas, at);
        canvas.disc(at(self.ends.1), 5.0, if self.eye.hit.is_some() { HIT } else { RAY });
        canvas.disc(at(self.ends.1), 2.0, RAY);
        if let Some(Window { middle, half }) = frame {
            let corner = |x: f64, y: f64| place(middle + DVec2::new(x, y) * half);
            let ring = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            (0..4).for_each(|i| canvas.line(ring[i], ring[(i + 1) % 4], 1.0, INK, 0.8));
        }
        canvas
    }

    /// Renders the scene itself, dimmed.
    fn backdrop(&self, job: &Job, window: Window) -> Canvas {
        let eye = self.view.eye + self.view.right * window.middle.x + self.view.up * window.middle.y;
        let view = View { eye, lens: Lens::orthographic(2.0 * window.half), ..self.view };
        let settings = Settings { width: SIDE, height: SIDE, samples: 4, depth: Some(2), ..Settings::default() };
        let rendered = render(&Job { view: &view, settings: &settings, ..*job }, &());
        let mut canvas = Canvas::of(&rendered.picture, [0.0; 3]);
        canvas.wash(PAPER, 0.5);
        canvas
    }

    /// Edges of a box, or the silhouette of a sphere.
    fn outline(&self, visit: &Visit) -> Vec<[DVec3; 2]> {
        if let Extent::Ball { center, radius } = visit.extent {
            let middle = self.told.world.center + center;
            let rim = |i: i32| {
                let (sin, cos) = libm::sincos(f64::from(i) * std::f64::consts::TAU / 96.0);
                middle + (self.view.right * cos + self.view.up * sin) * radius
            };
            return (0..96).map(|i| [rim(i), rim(i + 1)]).collect();
        }
        let corner = self.corners(visit);
        let edges = (0..8usize).flat_map(|i| [1, 2, 4].map(|k| (i, i | k))).filter(|(i, j)| i != j);
        edges.map(|(i, j)| [corner[i], corner[j]]).collect()
    }

    /// Descendants of the primary ray, as coloured lines.
    fn secondary(&self) -> Vec<(Color, [DVec3; 2])> {
        let far = (self.scene.1 - self.scene.0).length();
        let queries = self.told.ray_tree.queries.iter().skip(1);
        let drawn = |query: &Query| {
            let color = match query.class {
                Class::Primary => RAY,
                Class::Shadow if query.question == Question::Occluded => SHADOW,
                Class::Shadow => return None,
                Class::Reflected => REFLECTED,
                Class::Refracted => REFRACTED,
            };
            let dir = query.ray.dir.as_dvec3();
            let from = if query.after.is_some() { f64::from(query.after.t) } else { 0.0 };
            let open = f64::from(query.ray.t_max).min(far / dir.length());
            let to = if query.hit.is_some() { f64::from(query.hit.t) } else { from + open };
            let origin = in_world(self.told.world, query.ray.origin);
            Some((color, [origin + dir * from, origin + dir * to]))
        };
        queries.filter_map(drawn).collect()
    }

    /// Numbers the leaves in the order of the walk, where there is room.
    fn number(&self, canvas: &mut Canvas, at: impl Fn(DVec3) -> DVec2) {
        let leaves = self.parts.iter().filter(|(_, part)| *part != Part::Inner);
        let mut last: Option<DVec2> = None;
        for (number, (visit, part)) in (1..).zip(leaves) {
            let Some((enter, leave)) = inside(&visit.extent, &self.eye.ray) else { continue };
            let t = 0.5 * (enter + leave.min(f64::MAX));
            let dir = self.eye.ray.dir.as_dvec3();
            let place = at(in_world(self.told.world, self.eye.ray.origin) + dir * t) + DVec2::new(0.0, 10.0);
            let text = number.to_string();
            let room = f64::from(text_width(&text, DOT)) + 8.0;
            let on_canvas = place.cmpge(DVec2::ZERO).all() && place.cmple(DVec2::splat(f64::from(SIDE))).all();
            if on_canvas && last.is_none_or(|last| (place - last).length() > room) {
                let left = place.x - 0.5 * room + 4.0;
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "on the canvas")]
                canvas.write(left.max(0.0) as u32, place.y as u32, &text, DOT, part.color());
                last = Some(place);
            }
        }
    }

    /// Identity of the ray, and its result.
    fn title(&self) -> [String; 2] {
        let (x, y) = self.told.pixel;
        let c = &self.eye.counts;
        let end =
            if self.eye.hit.is_some() { format!("hits prim {}", self.eye.hit.prim) } else { "hits nothing".into() };
        let prims = grouped(self.told.world.len() as u64);
        [
            format!("{} over {prims} prims: the eye ray of pixel {x},{y}", self.told.accel),
            format!("visits {} nodes and cells, tests {} prims, {end}", grouped(c.n_ts), grouped(c.n_it)),
        ]
    }

    /// Colours that occur in the picture, with their meaning.
    fn legend(&self) -> Vec<(Color, String)> {
        let from = self.flat(self.ends.0);
        let side = match (from.y.abs() > from.x.abs(), from) {
            (true, from) if from.y > 0.0 => "above",
            (true, _) => "below",
            (false, from) if from.x < 0.0 => "the left",
            (false, _) => "the right",
        };
        let mut legend = vec![(RAY, format!("eye ray, from {side}; dot: its end"))];
        for part in Part::ALL {
            let count = self.parts.iter().filter(|(_, p)| *p == part).count();
            let text = match part {
                Part::Inner => format!("inner nodes: {count}"),
                Part::Empty => format!("empty leaves: {count}"),
                Part::Tested => format!("other leaves with prims: {count}"),
                Part::Hit => "leaf in which the hit was found".into(),
            };
            if count > 0 {
                legend.push((part.color(), text));
            }
        }
        let secondary = self.secondary();
        for (color, name) in [(SHADOW, "shadow"), (REFLECTED, "reflected"), (REFRACTED, "refracted")] {
            let count = secondary.iter().filter(|(c, _)| *c == color).count();
            if count > 0 {
                legend.push((color, format!("{name} rays: {count}")));
            }
        }
        legend
    }
}

/// Corners of a box; bit k of the index selects the upper side on axis k.
fn corners((lo, hi): (DVec3, DVec3)) -> [DVec3; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|i: u8| {
        let pick = |k: usize| if i >> k & 1 == 1 { hi[k] } else { lo[k] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}
