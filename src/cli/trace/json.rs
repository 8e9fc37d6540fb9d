//! Ray tree of a sample as JSON; the schema is described in [`super`].

use super::TraceReport;
use super::words::{hit_surface, in_world, inside, light, object};
use crate::accel::probe::{Extent, NodeId, Test, Visit};
use crate::accel::{Hit, RayCounts};
use crate::number::hash;
use crate::render::Question;
use crate::render::ray_tree::{Class, Event, Query};
use serde_json::{Map, Value, json};

/// Writes one object.
pub(super) fn write(told: &TraceReport) -> String {
    let settings = told.settings;
    let value = json!({
        "schema": "meshray-trace/1",
        "version": super::super::version::SHORT,
        "file": told.name,
        "hash": hash(told.loaded.facts.hash),
        "view": told.view,
        "width": settings.width,
        "height": settings.height,
        "pixel": [told.pixel.0, told.pixel.1],
        "sample": told.sample,
        "samples": settings.samples,
        "depth": told.ray_tree.depth,
        "accel": told.accel.name(),
        "prims": told.world.len(),
        "radiance": told.ray_tree.radiance.to_array(),
        "through": told.ray_tree.through.to_array(),
        "ray": query(told, 0),
    });
    format!("{value:#}\n")
}

fn query(told: &TraceReport, i: usize) -> Value {
    let query = &told.ray_tree.queries[i];
    let scene = &told.loaded.scene;
    let mut object = Map::new();
    let mut set = |key: &str, value: Value| drop(object.insert(key.into(), value));
    set("class", query.class.name().into());
    set("question", question(query.question).into());
    if query.class == Class::Shadow {
        set("light", light(scene, query.light).into());
        set("riser", query.riser.into());
    }
    set("origin", in_world(told.world, query.ray.origin).to_array().to_vec().into());
    set("direction", query.ray.dir.to_array().to_vec().into());
    set("t_min", query.ray.t_min.into());
    if i == 0 {
        set("skipped", told.skipped().into());
    }
    // An infinite `t_max` becomes null, as JSON has no infinity.
    set("t_max", Some(query.ray.t_max).filter(|t| t.is_finite()).into());
    if query.after.is_some() {
        set("after", json!({"t": query.after.t, "prim": query.after.prim}));
    }
    set("counts", counts(&query.counts));
    set("hit", hit(told, query));
    if i == 0 || told.all_steps {
        set("steps", query.events.iter().map(|event| step(told, query, event)).collect());
    }
    set("rays", query.children.iter().map(|&child| self::query(told, child)).collect());
    Value::Object(object)
}

const fn question(question: Question) -> &'static str {
    match question {
        Question::Closest => "closest",
        Question::Occluded => "occluded",
        Question::Next => "next",
    }
}

fn counts(c: &RayCounts) -> Value {
    c.named().into_iter().map(|(name, n)| (name.to_owned(), Value::from(n))).collect()
}

fn hit(told: &TraceReport, query: &Query) -> Value {
    let Hit { t, prim, .. } = query.hit;
    let Some(hit_surface) = hit_surface(told.loaded, told.world, query) else { return Value::Null };
    if query.question == Question::Occluded {
        return json!({"t": t, "prim": prim, "object": object(&told.loaded.scene, told.world, prim)});
    }
    json!({
        "t": t,
        "u": hit_surface.weights[0],
        "v": hit_surface.weights[1],
        "prim": prim,
        "object": hit_surface.object,
        "material": hit_surface.material,
        "position": hit_surface.position.to_array(),
        "normal": hit_surface.normal.to_array(),
    })
}

fn step(told: &TraceReport, query: &Query, event: &Event) -> Value {
    match event {
        Event::Visit(visit) => self::visit(told, query, visit),
        Event::Test(Test { prim, t, outcome }) => {
            json!({"test": prim, "outcome": outcome.name(), "t": Some(t).filter(|t| t.is_finite())})
        }
        Event::Skipped(prim) => json!({"mailbox": prim}),
        Event::Volumes(n) => json!({"volumes": n}),
        Event::Transforms(n) => json!({"transforms": n}),
    }
}

fn visit(told: &TraceReport, query: &Query, visit: &Visit) -> Value {
    let (what, at) = match visit.place {
        NodeId::Cell(cell) => ("cell", json!(cell)),
        NodeId::OctreeNode(at, level) => ("octree node", json!([at[0], at[1], at[2], level])),
        NodeId::Octant(at, level) => ("octant", json!([at[0], at[1], at[2], level])),
        NodeId::Node(i) => ("node", json!(i)),
        NodeId::Leaf(i) => ("leaf", json!(i)),
        NodeId::Block(i) => ("block", json!(i)),
        NodeId::Run(i) => ("run", json!(i)),
        NodeId::Places(i) => ("places", json!(i)),
        NodeId::PlacedNode(first, i) => ("placed node", json!([first, i])),
        NodeId::PlacedBlock(first, i) => ("placed block", json!([first, i])),
        NodeId::Object(i) => ("object", json!(i)),
    };
    let bounds = visit.extent.bounds();
    let corner = |p| in_world(told.world, p).to_array();
    let inside = inside(&visit.extent, &query.ray);
    json!({
        "visit": what,
        "at": at,
        "shape": if matches!(visit.extent, Extent::Ball { .. }) { "sphere" } else { "box" },
        "box": [corner(bounds.lo), corner(bounds.hi)],
        "t": inside.map(|(enter, leave)| [Some(enter), Some(leave).filter(|t| t.is_finite())]),
        "prims": visit.listed,
    })
}
