//! Reports of growth, sweeps, choices and differences.

use super::{SIZE, Stage, plan};
use crate::accel::{AccelKind, Count, RayCounts, auto};
use crate::bench::clock::Spread;
use crate::bench::compare::Plan;
use crate::bench::rays::Class;
use crate::bench::report::auto::sentences as auto_sentences;
use crate::bench::report::{Format, Model, Report, text};
use crate::bench::row::Row;
use crate::number::grouped;

/// Report of three sizes of a family whose costs follow exact power laws.
fn grown() -> Report {
    let whole = Stage::new().report(Plan { kinds: vec![AccelKind::None, AccelKind::Bvh], passes: 1, ..plan() });
    let model = |prims: usize| {
        let mut model = Model { name: format!("tetra-{prims}"), prims, ..whole.models[0].clone() };
        let [none, bvh] = &mut model.rows[..] else { panic!("two structures") };
        for class in none.classes.iter_mut() {
            class.counts.n_it = class.counts.queries * prims as u64;
        }
        for class in bvh.classes.iter_mut() {
            class.counts.n_it = class.counts.queries * prims.isqrt() as u64;
        }
        bvh.made_of.bytes = 7 * prims as u64;
        model
    };
    let models = [100, 10_000, 1_000_000].map(model).into();
    Report { family: Some("tetra".parse().unwrap()), models, ..whole }
}

#[test]
fn every_format_tells_the_exponents_of_growth() {
    let mut report = grown();
    let json: serde_json::Value = serde_json::from_str(&Format::Json.write(&report)).unwrap();
    let [none, bvh] = [&json["growth"]["structures"][0], &json["growth"]["structures"][1]];
    assert_eq!((&json["growth"]["family"], &bvh["accel"]), (&"tetra".into(), &"bvh".into()));
    let is = |value: &serde_json::Value, expected: f64| (value.as_f64().unwrap() - expected).abs() < 1e-9;
    assert!(is(&none["all"]["n_it"]["exponent"], 1.0) && is(&bvh["all"]["n_it"]["exponent"], 0.5), "{bvh:#}");
    assert!(is(&bvh["all"]["bytes"]["exponent"], 1.0) && is(&bvh["all"]["bytes"]["factor"], 7.0), "{bvh:#}");
    assert!(is(&bvh["classes"]["diffuse"]["n_it"]["exponent"], 0.5) && none["all"]["t_b"].is_null(), "{none:#}");

    let csv = Format::Csv.write(&report);
    let place = csv.lines().next().unwrap().split(',').position(|c| c == "e_n_it").unwrap();
    let exponents: Vec<f64> = csv.lines().skip(1).map(|l| l.split(',').nth(place).unwrap().parse().unwrap()).collect();
    assert_eq!(exponents.len(), 3 * 2 * Class::ALL.len());
    assert!(exponents.iter().all(|e| (e - 1.0).abs() < 1e-9 || (e - 0.5).abs() < 1e-9));

    for text in [text::write_growth(&report), Format::Markdown.write(&report), Format::Html.write(&report)] {
        assert!(text.contains("0.50 ±0.00") && text.contains("1 000 000"), "{text}");
    }
    assert!(Format::Html.write(&report).contains(">bvh 0.50</text>"));
    let text = text::write_growth(&report);
    assert!(text.lines().any(|l| l.starts_with("10 000  ") && l.contains("fast-octree")), "{text}");
    // A single size has no growth, which is no error.
    report.models.truncate(1);
    assert!(text::write_growth(&report).contains("One size only"));
}

/// Report of a sweep over the small scene.
fn swept(sweep: &str, kinds: &[AccelKind], passes: usize) -> Report {
    Stage::new().report(Plan { kinds: kinds.into(), sweep: Some(sweep.parse().unwrap()), passes, ..plan() })
}

#[test]
fn a_sweep_tells_every_value_and_the_default_and_their_hits_are_the_same() {
    let report = swept("grid-density=0.5..16", &[AccelKind::Grid, AccelKind::GridOctree], 0);
    let model = &report.models[0];
    assert!(model.differing() == 0 && model.rows.iter().all(|r| r.rays() == model.rows[0].rays()));
    let values = |kind| model.rows.iter().filter(move |r| r.kind == kind).map(|r| r.setting.unwrap().value.unwrap());
    assert_eq!(values(AccelKind::Grid).collect::<Vec<_>>(), [0.5, 1.0, 2.0, 4.0, 8.0, 16.0]);
    assert_eq!(values(AccelKind::GridOctree).collect::<Vec<_>>(), [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0]);
    let [coarse, finer] = [0, 2].map(|i| model.rows[i].made_of.n_v);
    assert!(finer > coarse, "the parameter reaches the structures: {coarse}, {finer} cells");

    let json: serde_json::Value = serde_json::from_str(&Format::Json.write(&report)).unwrap();
    assert_eq!(json["sweep"]["parameter"], "grid-density");
    let (rows, best) = (&json["models"][0]["structures"], &json["models"][0]["best"]);
    assert_eq!((&rows[3]["setting"]["value"], &rows[3]["setting"]["is_default"]), (&4.0.into(), &true.into()));
    let cost = |row: &serde_json::Value| -> f64 {
        let counts = |c: &serde_json::Value| c["tests"].as_f64().unwrap() + c["steps"].as_f64().unwrap();
        row["classes"].as_object().unwrap().values().map(counts).sum()
    };
    let costs: Vec<f64> = (0..6).map(|i| cost(&rows[i])).collect();
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let place = costs.iter().position(|&c| c == least).unwrap();
    assert_eq!((&best[0]["accel"], &best[0]["value"]), (&"grid".into(), &rows[place]["setting"]["value"]));
    assert!((best[0]["saved"].as_f64().unwrap() - (1.0 - least / costs[3])).abs() < 1e-9);

    let csv = Format::Csv.write(&report);
    assert!(csv.lines().filter(|l| l.contains(",grid-density,16,false")).count() == 2 * Class::ALL.len(), "{csv}");
    let text = text::write(&report, model);
    for text in [&text, &Format::Markdown.write(&report), &Format::Html.write(&report)] {
        assert!(text.contains("4 default") || text.contains("4 best default"), "{text}");
        assert!(text.contains("grid-octree: ") && text.contains("tests and visits a ray together"), "{text}");
    }
}

#[test]
fn a_structure_whose_default_has_no_such_value_is_compared_with_it_all_the_same() {
    let report = swept("leaf-size=1,8", &[AccelKind::Octree, AccelKind::Bvh], 1);
    let settings = |kind| report.models[0].rows.iter().filter(move |r| r.kind == kind).map(|r| r.setting.unwrap());
    let octree: Vec<_> = settings(AccelKind::Octree).map(|s| (s.value, s.is_default)).collect();
    assert_eq!(octree, [(Some(1.0), false), (Some(8.0), false), (None, true)]);
    assert_eq!(settings(AccelKind::Bvh).filter(|s| s.is_default).map(|s| s.value).collect::<Vec<_>>(), [Some(2.0)]);
    let html = Format::Html.write(&report);
    // One per cost: tests, visits, time, memory, build.
    assert_eq!(html.matches("k-octree level").count(), 5);
    assert_eq!(html.matches("<circle class=\"k-bvh around\"").count(), 5);
}

#[test]
fn what_auto_would_choose_is_held_against_the_rays() {
    let kinds = vec![AccelKind::FastOctree, AccelKind::FastBvh];
    let mut report = Stage::new().report(Plan { kinds, ..plan() });
    // In so small a scene both are a single leaf; make the second cost more.
    report.models[0].rows[1].classes.iter_mut().for_each(|c| c.counts.n_ts += c.counts.queries);
    let nodes = |row: &Row| {
        let mut sum = RayCounts::default();
        row.classes.iter().for_each(|c| sum += c.counts);
        auto::nodes(&sum)
    };
    let [octree, bvh] = [0, 1].map(|i| nodes(&report.models[0].rows[i]));
    assert!(bvh > octree * 1.1, "{octree} {bvh}");
    for (kind, won) in [(AccelKind::FastOctree, bvh / octree - 1.0), (AccelKind::FastBvh, octree / bvh - 1.0)] {
        report.models[0].auto.as_mut().unwrap().kind = kind;
        let said = auto_sentences(&report, &report.models[0]);
        assert!(said[0].starts_with(&format!("auto would choose {kind}: ")), "{said:?}");
        let is_right = if won > -5e-4 { "was right" } else { "was wrong" };
        assert!(said[1].contains(is_right) && said[1].contains(&format!("{:.1} %", 100.0 * won.abs())), "{said:?}");
        let json: serde_json::Value = serde_json::from_str(&Format::Json.write(&report)).unwrap();
        let auto = &json["models"][0]["auto"];
        assert!((auto["won_nodes"].as_f64().unwrap() - won).abs() < 1e-12 && auto["won_time"].is_null(), "{auto}");
    }
    report.models[0].rows.pop();
    assert_eq!(auto_sentences(&report, &report.models[0]).len(), 1, "in one tree there is nothing to be measured");
    report.models[0].auto.as_mut().unwrap().why = auto::Why::FewPrims;
    let said = auto_sentences(&report, &report.models[0]);
    assert!(said[1].contains("not measured"), "{said:?}");
}

#[test]
fn a_model_tells_how_many_objects_can_be_bounded() {
    let mut report = Stage::new().report(Plan { kinds: vec![AccelKind::Boxes], ..plan() });
    assert!(report.models[0].size().ends_with("in 4 objects"), "a box and three balls");
    report.models[0].objects = 1;
    let one = "15 prims in one object: spheres and boxes can only bound the whole";
    let written = [Format::Html, Format::Markdown].map(|f| f.write(&report));
    assert!(written.iter().chain([&text::write(&report, &report.models[0])]).all(|text| text.contains(one)));
}

#[test]
fn the_difference_image_is_of_those_asked_for_or_of_the_fast_ones() {
    let kinds = vec![AccelKind::None, AccelKind::Grid, AccelKind::FastOctree, AccelKind::FastBvh];
    let mut report = Stage::new().report(Plan { kinds, ..plan() });
    assert!(Format::Html.write(&report).contains("Tests in each pixel: fast-octree minus fast-bvh"));
    report.compare = Some([AccelKind::Grid, AccelKind::None]);
    let html = Format::Html.write(&report);
    let rows = &report.models[0].rows;
    let fewer = rows[0].tests_by_pixel.iter().zip(&rows[1].tests_by_pixel).filter(|(none, grid)| grid < none).count();
    let share = 100.0 * fewer as f64 / f64::from(SIZE.0 * SIZE.1);
    assert!(html.contains("grid minus none") && html.contains(&format!("in {share:.1} % of the pixels (blue)")));
    report.models[0].rows[0].tests_by_pixel.clear();
    assert!(Format::Html.write(&report).contains("No image of grid minus none"));
    report.compare = None;
    report.models[0].rows.truncate(3);
    assert!(Format::Html.write(&report).contains("grid minus fast-octree"));
}

#[test]
fn times_that_overlap_or_come_from_one_pass_are_said_to_be_doubtful() {
    let told = |times: [&[f64]; 2]| {
        let kinds = vec![AccelKind::FastOctree, AccelKind::FastBvh];
        let mut report = Stage::new().report(Plan { kinds, ..plan() });
        report.plan.passes = times[0].len();
        // In so small a scene both are a single leaf; make their sizes differ.
        report.models[0].rows[1].made_of.n_in += 1;
        for (row, times) in report.models[0].rows.iter_mut().zip(times) {
            row.classes.iter_mut().for_each(|c| times.iter().for_each(|&t| c.seconds.push(t)));
        }
        auto_sentences(&report, &report.models[0]).swap_remove(1)
    };
    assert!(told([&[4.0, 5.0], &[6.0, 6.75]]).contains("right: fast-bvh takes 41.7 % more time;"));
    assert!(told([&[4.0, 5.0], &[3.0, 3.3]]).contains("wrong: fast-bvh takes 30.0 % less time;"));
    let doubtful = told([&[4.0, 5.0], &[4.5, 9.0]]);
    assert!(doubtful.contains("neither right nor wrong") && doubtful.contains("(within the spread of the passes)"));
    assert!(told([&[4.0], &[6.0]]).contains("50.0 % more time (one pass only"));
}

#[test]
fn of_one_tree_the_clock_is_not_asked() {
    let kinds = vec![AccelKind::FastOctree, AccelKind::FastBvh];
    let mut report = Stage::new().report(Plan { kinds, passes: 2, ..plan() });
    let [octree, bvh] = &mut report.models[0].rows[..] else { panic!("two structures") };
    octree.classes.iter_mut().for_each(|class| [4.0, 5.0].into_iter().for_each(|t| class.seconds.push(t)));
    bvh.classes.iter_mut().for_each(|class| [1.0, 2.0].into_iter().for_each(|t| class.seconds.push(t)));
    let told = auto_sentences(&report, &report.models[0]).swap_remove(1);
    assert_eq!(told, "On these rays that makes no difference: fast-bvh is the same tree");
}

#[test]
fn a_rate_is_that_of_the_median_time_also_of_two_passes() {
    let mut report = Stage::new().report(Plan { kinds: vec![AccelKind::Grid], passes: 1, ..plan() });
    let class = &mut report.models[0].rows[0].classes[0];
    class.seconds = Spread::default();
    [2e-6, 6e-6].into_iter().for_each(|seconds| class.seconds.push(seconds));
    let [median, min, max] = class.rates();
    assert!((median - 0.25).abs() < 1e-12 && (min - 1.0 / 6.0).abs() < 1e-12 && (max - 0.5).abs() < 1e-12);
    let json: serde_json::Value = serde_json::from_str(&Format::Json.write(&report)).unwrap();
    assert_eq!(json["models"][0]["structures"][0]["classes"]["primary"]["mrays"]["median"], median);
}

#[test]
fn an_average_ray_is_one_of_the_mixture_that_the_picture_asks_however_many_are_kept() {
    let stage = Stage::new();
    let all = stage.report(Plan { kinds: vec![AccelKind::Grid], ..plan() });
    let tests: u64 = all.models[0].rows[0].classes.iter().map(|c| c.counts.n_it).sum();
    let mean = |report: &Report| report.models[0].per_ray(&report.models[0].rows[0], Count::It);
    assert!((mean(&all) - tests as f64 / all.models[0].rows[0].rays() as f64).abs() < 1e-9);
    // Keep equally many rays of each class, although their costs differ.
    let mut few = all.clone();
    let (model, least) = (&mut few.models[0], all.models[0].rays.iter().map(|rays| rays.kept).min().unwrap());
    for (rays, class) in model.rays.iter_mut().zip(&mut model.rows[0].classes) {
        assert_eq!(rays.asked, class.counts.queries);
        class.counts.n_it = class.counts.n_it * 1000 / rays.asked;
        (rays.kept, class.counts.queries) = (least, 1000);
    }
    assert!((mean(&few) / mean(&all) - 1.0).abs() < 1e-2, "{} {}", mean(&few), mean(&all));
}

#[test]
fn hits_are_identical_of_the_rays_that_two_structures_got() {
    let stage = Stage::new();
    let prims = stage.world.shapes.len() as u64;
    let report = |kinds: &[AccelKind]| stage.report(Plan { kinds: kinds.into(), slow_tests: 30 * prims, ..plan() });
    let told = |kinds: &[AccelKind]| report(kinds).models[0].verdict();
    let all = report(&[AccelKind::Grid, AccelKind::Bvh, AccelKind::None]);
    let (sent, few) = (all.models[0].rows[0].rays(), all.models[0].rows[2].rays());
    assert!(few < sent && all.models[0].verdict().ends_with(&format!("{} rays (a sample for none)", grouped(sent))));
    assert!(told(&[AccelKind::None, AccelKind::Boxes]).ends_with(&format!("structures: {few} rays")));
    assert!(told(&[AccelKind::Grid, AccelKind::None]).ends_with(&format!("structures: {few} rays")));
    let alone = report(&[AccelKind::None]);
    assert!(alone.models[0].verdict().contains(&format!("only, {few} rays")));
    let json: serde_json::Value = serde_json::from_str(&Format::Json.write(&alone)).unwrap();
    assert_eq!(
        (&json["models"][0]["identical"], &json["models"][0]["compared"]),
        (&serde_json::Value::Null, &0.into())
    );
}

#[test]
fn slow_structures_end_where_they_would_take_for_ever() {
    let plan = plan();
    let limit = (plan.slow_tests / Plan::FEWEST as u64) as usize;
    assert!(plan.can_bear(AccelKind::None, limit) && !plan.can_bear(AccelKind::None, limit + 1));
    assert!(plan.can_bear(AccelKind::Grid, 10_000_000));
}
