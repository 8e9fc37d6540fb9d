//! Every level rounds, compares and moves like scalar code.

use super::*;
use crate::math::random::Random;

#[test]
fn levels_are_named_as_they_are_printed_or_typed_if_the_machine_has_them() {
    for level in Level::all() {
        for name in [level.name(), level.word()] {
            assert_eq!(name.to_lowercase().parse(), Ok(level));
        }
    }
    let fault = "sse9".parse::<Level>().unwrap_err().to_string();
    assert!(Level::all().iter().all(|level| fault.contains(level.word())), "{fault}");
}

#[test]
fn a_level_that_was_given_out_stays() {
    let best = Level::best();
    assert_eq!(best.choose(), Ok(()));
    for other in Level::all().into_iter().filter(|level| *level != best) {
        assert_eq!(other.choose(), Err(best));
    }
    assert_eq!(Level::best(), best);
}

const HARD: [f32; 10] =
    [0.0, -0.0, 1.0, -3.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-42, f32::MAX, f32::MIN_POSITIVE];

/// Bits of a number; all NaNs are equal, because their sign and payload may differ.
fn bits(x: f32) -> u64 {
    u64::from(if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() })
}

fn bits_f64(x: f64) -> u64 {
    if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }
}

/// Results of all operations on lanes, as bits. `mask` selects some lanes.
#[inline(always)]
fn everything<S: Lanewise<N>, const N: usize>(s: S, rows: &[[f32; N]; 2], mask: u32) -> Vec<u64> {
    let (a, b) = (s.load(&rows[0]), s.load(&rows[1]));
    let results = [
        s.add(a, b),
        s.sub(a, b),
        s.mul(a, b),
        s.div(a, b),
        s.abs(a),
        s.greater(a, b),
        s.smaller(a, b),
        s.splat(rows[0][1]),
    ];
    let mut all: Vec<u64> = results.into_iter().flat_map(|r| s.store(r)).map(bits).collect();
    all.extend([s.less(a, b), s.at_most(a, b)].map(u64::from));

    let mut words = rows[1].map(f32::to_bits);
    s.put_word(mask, 7, &mut words);
    all.extend(s.store(s.choose(mask, a, b)).map(bits));
    all.extend(words.map(u64::from));
    all.push(u64::from(s.find_word(7, &words)));

    let third = s.splat_f64(1.0 / 3.0);
    let c = s.mul_f64(s.widen(a), third);
    let d = s.widen(b);
    let results = [
        s.add_f64(c, d),
        s.sub_f64(c, d),
        s.mul_f64(c, d),
        s.div_f64(c, d),
        s.abs_f64(c),
        s.greater_f64(c, d),
        s.smaller_f64(c, d),
        s.widen(s.narrow(c)),
        s.choose_f64(mask, c, d),
    ];
    all.extend(results.into_iter().flat_map(|r| s.store_f64(r)).map(bits_f64));
    all.push(u64::from(s.less_f64(c, d)));
    all
}

/// The same results in scalar arithmetic, one lane after another.
fn plainly<const N: usize>(rows: &[[f32; N]; 2], mask: u32) -> Vec<u64> {
    let [a, b] = rows;
    let each = |f: fn(f32, f32) -> f32| (0..N).map(|k| bits(f(a[k], b[k]))).collect::<Vec<_>>();
    let holds = |f: fn(f32, f32) -> bool| (0..N).fold(0, |m, k| m | u64::from(f(a[k], b[k])) << k);
    let greater = |a: f32, b: f32| if a > b { a } else { b };
    let smaller = |a: f32, b: f32| if a < b { a } else { b };
    let mut all = [
        each(|a, b| a + b),
        each(|a, b| a - b),
        each(|a, b| a * b),
        each(|a, b| a / b),
        each(|a, _| a.abs()),
        each(greater),
        each(smaller),
        vec![bits(a[1]); N],
    ]
    .concat();
    all.extend([holds(|a, b| a < b), holds(|a, b| a <= b)]);
    let chosen = |k: usize| mask >> k & 1 == 1;
    all.extend((0..N).map(|k| bits(if chosen(k) { a[k] } else { b[k] })));
    let words: Vec<u32> = (0..N).map(|k| if chosen(k) { 7 } else { b[k].to_bits() }).collect();
    all.extend(words.iter().map(|&w| u64::from(w)));
    all.push(words.iter().enumerate().fold(0, |m, (k, &w)| m | u64::from(w == 7) << k));

    let c: [f64; N] = a.map(|x| f64::from(x) * (1.0 / 3.0));
    let d: [f64; N] = b.map(f64::from);
    let each = |f: fn(f64, f64) -> f64| (0..N).map(|k| bits_f64(f(c[k], d[k]))).collect::<Vec<_>>();
    let results = [
        each(|a, b| a + b),
        each(|a, b| a - b),
        each(|a, b| a * b),
        each(|a, b| a / b),
        each(|a, _| a.abs()),
        each(|a, b| if a > b { a } else { b }),
        each(|a, b| if a < b { a } else { b }),
        each(|a, _| f64::from(a as f32)),
    ];
    all.extend(results.concat());
    all.extend((0..N).map(|k| bits_f64(if chosen(k) { c[k] } else { d[k] })));
    all.push((0..N).fold(0, |m, k| m | u64::from(c[k] < d[k]) << k));
    all
}

struct Narrow([Row; 2], u32);

impl Kernel for Narrow {
    type Output = Vec<u64>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Vec<u64> {
        everything(s, &self.0, self.1)
    }
}

/// Kernel for sixteen and thirty-two lanes.
struct More([[f32; WIDE]; 2], [[f32; BROAD]; 2], u32);

impl Kernel for More {
    type Output = [Vec<u64>; 2];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> [Vec<u64>; 2] {
        [everything(s.wide(), &self.0, self.2 & 0xffff), everything(s.broad(), &self.1, self.2)]
    }
}

#[test]
fn every_level_computes_like_plain_numbers() {
    for (i, &x) in HARD.iter().enumerate() {
        for (j, &y) in HARD.iter().enumerate() {
            let a: [f32; BROAD] = std::array::from_fn(|k| HARD[(i + k) % HARD.len()]);
            let b: [f32; BROAD] = std::array::from_fn(|k| if k % 2 == 0 { x } else { y });
            let mask = (0x9e37_79b9_u32).rotate_left((10 * i + j) as u32);
            let first = [*a.first_chunk().unwrap(), *b.first_chunk().unwrap()];
            let half = [*a.first_chunk().unwrap(), *b.first_chunk().unwrap()];
            for level in Level::all() {
                let name = level.name();
                let expected = [plainly(&half, mask & 0xffff), plainly(&[a, b], mask)];
                assert_eq!(level.run(More(half, [a, b], mask)), expected, "{name} {a:?} {b:?} {mask:x}");
                let eight = plainly::<LANES>(&first, mask & 0xff);
                assert_eq!(level.run(Narrow(first, mask & 0xff)), eight, "{name} {first:?} {mask:x}");
            }
        }
    }
}

/// Kernel for the least and the greatest of all lanes.
struct Ends([f32; BROAD]);

impl Kernel for Ends {
    type Output = [f32; 6];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> [f32; 6] {
        let (b, all) = (s.broad(), s.broad().load(&self.0));
        let (w, half) = (s.wide(), s.wide().load(self.0.first_chunk().unwrap()));
        let eight = s.load(self.0.first_chunk().unwrap());
        [b.least(all), b.greatest(all), w.least(half), w.greatest(half), s.least(eight), s.greatest(eight)]
    }
}

#[test]
fn the_ends_of_a_row_are_found_wherever_they_stand() {
    for low in 0..BROAD {
        for high in (0..BROAD).filter(|&high| high != low) {
            let mut row: [f32; BROAD] = std::array::from_fn(|k| k as f32);
            (row[low], row[high]) = (-5.0, 50.0);
            let ends = |row: &[f32]| {
                [row.iter().copied().fold(f32::INFINITY, f32::min), row.iter().copied().fold(0.0, f32::max)]
            };
            let expected = [ends(&row), ends(&row[..WIDE]), ends(&row[..LANES])].concat();
            for level in Level::all() {
                assert_eq!(level.run(Ends(row))[..], expected, "{}", level.name());
            }
        }
    }
}

/// Kernel for the least of each of four rows, with thirty-two, sixteen and eight lanes.
struct LeastOfEach([[f32; BROAD]; 4]);

impl Kernel for LeastOfEach {
    type Output = [[f32; 4]; 3];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> [[f32; 4]; 3] {
        let (t, w, [a, b, c, d]) = (s.broad(), s.wide(), &self.0);
        let broad = t.least_of_each([t.load(a), t.load(b), t.load(c), t.load(d)]);
        let [a, b, c, d] = [a, b, c, d].map(|row| row.first_chunk().unwrap());
        let wide = w.least_of_each([w.load(a), w.load(b), w.load(c), w.load(d)]);
        let [a, b, c, d] = [a, b, c, d].map(|row| row.first_chunk().unwrap());
        [broad, wide, s.least_of_each([s.load(a), s.load(b), s.load(c), s.load(d)])]
    }
}

#[test]
fn the_least_of_each_of_four_rows_is_found_wherever_it_stands() {
    for low in 0..BROAD {
        let rows: [[f32; BROAD]; 4] = std::array::from_fn(|row| {
            let at = (low + 5 * row) % BROAD;
            std::array::from_fn(|k| if k == at { -1.0 - row as f32 } else { (k * 3 % 7) as f32 + row as f32 })
        });
        let least = |lanes: usize| rows.map(|row| row[..lanes].iter().copied().fold(f32::INFINITY, f32::min));
        for level in Level::all() {
            assert_eq!(level.run(LeastOfEach(rows)), [least(BROAD), least(WIDE), least(LANES)], "{}", level.name());
        }
    }
}

/// Kernel that transposes rows and back, permutes a row, picks one of six rows, and looks up numbers in a table.
struct Moved([[f32; 4]; LANES]);

impl Kernel for Moved {
    type Output = (Vec<Row>, [[f32; 4]; LANES], Row, [u32; LANES], [Row; 2]);

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let columns = s.columns(self.0.each_ref());
        let order = 0x7612_0534;
        let (mut arranged, mut words) = ([0.0; LANES], [0; LANES]);
        s.arrange(columns[1], order, &mut arranged);
        s.arrange_words(&s.store(columns[2]).map(f32::to_bits), order, &mut words);
        let mut rows = [s.store(columns[0]); 6];
        rows[4] = s.store(columns[3]);
        let picked = s.store(s.pick(&rows, Pick::new(4)));
        let found = s.store(s.among(&s.store(columns[1]), &[4, 11, 5, 0, 2, 1, 6, u32::MAX]));
        (columns.into_iter().map(|c| s.store(c)).collect(), s.rows(columns), arranged, words, [picked, found])
    }
}

#[test]
fn every_level_moves_numbers_to_the_same_places() {
    let rows: [[f32; 4]; LANES] = std::array::from_fn(|i| std::array::from_fn(|k| (4 * i + k) as f32));
    let order = [4, 3, 5, 0, 2, 1, 6, 7];
    for level in Level::all() {
        let (columns, back, arranged, words, [picked, found]) = level.run(Moved(rows));
        assert!((0..32).all(|i| columns[i % 4][i / 4] == rows[i / 4][i % 4]), "{}", level.name());
        assert_eq!(back, rows, "{}", level.name());
        assert_eq!(arranged, order.map(|lane| rows[lane][1]), "{}", level.name());
        assert_eq!(words, order.map(|lane: usize| rows[lane][2].to_bits()), "{}", level.name());
        assert_eq!(picked[..], columns[3], "{}", level.name());
        assert_eq!(found, order.map(|lane| rows[lane][1]), "{}", level.name());
    }
}

#[test]
fn the_second_operand_wins_over_nan() {
    let s = Portable;
    let (nan, one) = (s.splat(f32::NAN), s.splat(1.0));
    assert_eq!((s.store(s.greater(nan, one))[0], s.store(s.smaller(nan, one))[0]), (1.0, 1.0));
    assert!(s.store(s.greater(one, nan))[0].is_nan() && s.store(s.smaller(one, nan))[0].is_nan());
    assert_eq!((s.less(nan, one), s.at_most(one, nan), s.less(one, s.splat(2.0))), (0, 0, 255));
}

/// Comparisons of distances: the later ones, the sooner ones, the mask of ordered ones, and the latest.
#[inline(always)]
fn distances<S: Lanewise<N>, const N: usize>(s: S, [a, b]: &[[f32; N]; 2]) -> ([[f32; N]; 2], u32, f32) {
    let (a, b) = (s.load(a), s.load(b));
    ([s.store(s.later(a, b)), s.store(s.sooner(a, b))], s.in_order(a, b), s.latest(a))
}

struct Distances([[f32; BROAD]; 2]);

impl Kernel for Distances {
    type Output = Vec<([Vec<f32>; 2], u32, f32)>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let [a, b] = self.0;
        let (eight, sixteen) =
            ([*a.first_chunk().unwrap(), *b.first_chunk().unwrap()], [a, b].map(|r| *r.first_chunk().unwrap()));
        let (eight, sixteen, all) =
            (distances(s, &eight), distances(s.wide(), &sixteen), distances(s.broad(), &self.0));
        vec![
            (eight.0.map(Vec::from), eight.1, eight.2),
            (sixteen.0.map(Vec::from), sixteen.1, sixteen.2),
            (all.0.map(Vec::from), all.1, all.2),
        ]
    }
}

#[test]
fn every_level_knows_the_later_of_two_distances_from_zero_on() {
    let all: Vec<f32> = HARD.into_iter().filter(|x| !x.is_nan()).chain([-1e-42, -1.0, 2.5]).collect();
    let rows = |from: &[f32], step: usize| -> [[f32; BROAD]; 2] {
        [std::array::from_fn(|k| from[k % from.len()]), std::array::from_fn(|k| all[(k * step + k / 7) % all.len()])]
    };
    let behind: Vec<f32> = all.iter().copied().filter(|x| x.is_sign_negative()).collect();
    for (level, step) in Level::all().into_iter().flat_map(|level| (0..all.len()).map(move |step| (level, step))) {
        for [a, b] in [rows(&all, step), rows(&behind, step)] {
            for ([later, sooner], in_order, latest) in level.run(Distances([a, b])) {
                for (k, (&later, &sooner)) in later.iter().zip(&sooner).enumerate() {
                    let (a, b, name) = (a[k], b[k], level.name());
                    let one_of_both = |x: f32| [a, b].iter().any(|y| y.to_bits() == x.to_bits());
                    assert!(one_of_both(later) && one_of_both(sooner), "{name}: {later}, {sooner} of {a}, {b}");
                    let ahead = a.max(b) > 0.0;
                    assert!(!ahead || later == a.max(b), "{name}: {later} of {a}, {b}");
                    let behind = a.is_sign_negative() && b.is_sign_negative();
                    let expected = behind || if a.min(b) < 0.0 { sooner < 0.0 } else { sooner == a.min(b) };
                    assert!(expected, "{name}: {sooner} of {a}, {b}");
                    if a.is_sign_positive() && b.to_bits() != (-0.0f32).to_bits() {
                        assert_eq!(in_order >> k & 1 == 1, a <= b, "{name}: {a} {b}");
                    }
                }
                let row = &a[..later.len()];
                let most = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                assert!(
                    row.contains(&latest) && (most <= 0.0 || latest == most),
                    "{}: {latest} of {row:?}",
                    level.name()
                );
            }
        }
    }
}

/// [`HARD`], and a NaN with the other sign.
fn hard() -> Vec<f32> {
    HARD.into_iter().chain([f32::from_bits(0xffc0_0001)]).collect()
}

/// Calls `check` with rows in which every two hard numbers stand side by side, and a mask of some lanes.
fn each_hard_pair(mut check: impl FnMut([Row; 2], u32)) {
    let all = hard();
    for (i, &x) in all.iter().enumerate() {
        for (j, &y) in all.iter().enumerate() {
            let a = std::array::from_fn(|k| all[(i + k) % all.len()]);
            let b = std::array::from_fn(|k| if k % 2 == 0 { x } else { y });
            check([a, b], (0x9e37_79b9_u32).rotate_left((11 * i + j) as u32) & 0xff);
        }
    }
}

/// Kernel for the operations that only eight lanes have, as bits: none of them computes, so that NaNs keep theirs.
struct Only8([Row; 2], u32);

impl Kernel for Only8 {
    type Output = (Vec<[u32; LANES]>, [u32; 2]);

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let Self([x, y], mask) = self;
        let (a, b) = (s.load(&x), s.load(&y));
        let results = [s.choose(mask, a, b), s.choose(!mask, a, b), s.with_sign(a, b), s.with_sign(b, a)];
        (
            results.into_iter().map(|r| s.store(r).map(f32::to_bits)).collect(),
            [s.signs(a), s.high_bits(&y.map(f32::to_bits))],
        )
    }
}

#[test]
fn every_level_chooses_and_moves_signs_like_plain_numbers() {
    each_hard_pair(|[a, b], mask| {
        let chosen = |mask: u32| std::array::from_fn(|k| if mask >> k & 1 == 1 { a[k] } else { b[k] });
        let signed = |a: Row, b: Row| std::array::from_fn(|k| a[k].copysign(b[k]));
        let negative = |a: Row| (0..LANES).fold(0, |m, k| m | u32::from(a[k].is_sign_negative()) << k);
        let expected: Vec<_> =
            [chosen(mask), chosen(!mask), signed(a, b), signed(b, a)].map(|r: Row| r.map(f32::to_bits)).into();
        for level in Level::all() {
            let (moved, masks) = level.run(Only8([a, b], mask));
            assert_eq!(moved, expected, "{} {a:?} {b:?} {mask:x}", level.name());
            assert_eq!(masks, [negative(a), negative(b)], "{} {a:?} {b:?}", level.name());
        }
    });
}

struct Larger([Row; 2]);

impl Kernel for Larger {
    type Output = Row;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Row {
        s.store(s.larger(s.load(&self.0[0]), s.load(&self.0[1])))
    }
}

#[test]
fn the_larger_of_two_sizes_has_no_sign() {
    each_hard_pair(|[a, b], _| {
        for level in Level::all() {
            let larger = level.run(Larger([a, b]));
            for k in (0..LANES).filter(|&k| !a[k].is_nan() && !b[k].is_nan()) {
                let expected = a[k].abs().max(b[k].abs());
                assert!(larger[k] == expected, "{}: {} of {} and {}", level.name(), larger[k], a[k], b[k]);
                assert!(larger[k].is_sign_positive(), "{}: {} and {}", level.name(), a[k], b[k]);
            }
        }
    });
}

/// Kernel that loads rows by axis, and by index, with the other row of the pair.
struct Rows([Row; 6]);

impl Kernel for Rows {
    type Output = ([Row; 3], [[Row; 2]; 6]);

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let [x, y, z, ..] = self.0;
        let (mut along, mut picked) = ([[0.0; LANES]; 3], [[[0.0; LANES]; 2]; 6]);
        for (i, along) in along.iter_mut().enumerate() {
            *along = s.store(s.along(&[x, y, z], Axis::new(i)));
        }
        for (i, picked) in picked.iter_mut().enumerate() {
            let pick = Pick::new(i);
            *picked = [s.store(s.pick(&self.0, pick)), s.store(s.pick(&self.0, pick.other()))];
        }
        (along, picked)
    }
}

#[test]
fn rows_are_found_by_axis_and_by_number_and_others_beside_them() {
    let rows: [Row; 6] = std::array::from_fn(|i| std::array::from_fn(|k| (LANES * i + k) as f32));
    for level in Level::all() {
        let (along, picked) = level.run(Rows(rows));
        assert_eq!(along[..], rows[..3], "{}", level.name());
        assert_eq!(picked, std::array::from_fn(|i| [rows[i], rows[i ^ 1]]), "{}", level.name());
    }
    assert!((0..6).all(|i| Pick::new(i).other().other() == Pick::new(i)));
}

struct Soon<'a>(&'a [Row], &'a [u8]);

impl Kernel for Soon<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        for i in [0, 1, self.0.len(), 1 << 20, usize::MAX / 64] {
            for first in [true, false] {
                s.prefetch_either(first, (self.0, i), (self.1, i));
            }
        }
        s.prefetch(self.0);
        s.prefetch(self.1);
    }
}

#[test]
fn what_is_not_there_may_be_said_to_be_read_soon() {
    for level in Level::all() {
        level.run(Soon(&[[0.0; LANES]; 3], &[7; 5]));
        level.run(Soon(&[], &[]));
    }
}

/// a · b + c, a · b − c and c − a · b.
#[inline(always)]
fn products<S: Lanewise<N>, const N: usize>(s: S, [a, b, c]: &[[f32; N]; 3]) -> [[f32; N]; 3] {
    let (a, b, c) = (s.load(a), s.load(b), s.load(c));
    [s.store(s.mul_add(a, b, c)), s.store(s.mul_sub(a, b, c)), s.store(s.sub_mul(a, b, c))]
}

struct Products([[f32; WIDE]; 3]);

impl Kernel for Products {
    type Output = ([Row; 3], [[f32; WIDE]; 3]);

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let mut eight = [[0.0; LANES]; 3];
        for (eight, all) in eight.iter_mut().zip(&self.0) {
            eight.copy_from_slice(&all[..LANES]);
        }
        (products(s, &eight), products(s.wide(), &self.0))
    }
}

/// The three products, each rounded twice and once.
fn products_of([a, b, c]: [f32; 3]) -> [[f32; 2]; 3] {
    // Not the system's `fma`, which may round twice.
    let once = libm::fmaf;
    [[a * b + c, once(a, b, c)], [a * b - c, once(a, b, -c)], [c - a * b, once(-a, b, c)]]
}

fn assert_rounded_once_or_twice(numbers: [[f32; WIDE]; 3]) {
    for level in Level::all() {
        let (eight, wide) = level.run(Products(numbers));
        for lane in 0..WIDE {
            let of = numbers.map(|row| row[lane]);
            for (i, allowed) in products_of(of).into_iter().enumerate() {
                let is_one = |x: f32| allowed.iter().any(|&y| bits(y) == bits(x));
                let narrow = eight[i].get(lane).copied().unwrap_or(wide[i][lane]);
                assert!(is_one(wide[i][lane]) && is_one(narrow), "{}: {i} of {of:?}", level.name());
            }
        }
    }
}

#[test]
fn a_product_and_a_sum_are_rounded_once_or_twice() {
    let all = hard();
    for i in 0..all.len() * all.len() {
        let c = |k: usize| all[(i + 3 * k + k / 11) % all.len()];
        let (a, b) = ([all[i % all.len()]; WIDE], [all[i / all.len()]; WIDE]);
        assert_rounded_once_or_twice([a, b, std::array::from_fn(c)]);
    }
    let mut random = Random::new(31);
    for _ in 0..300 {
        // Sums that nearly cancel distinguish one rounding from two.
        let a: [f32; WIDE] = std::array::from_fn(|_| random.unit() + 0.5);
        let b: [f32; WIDE] = std::array::from_fn(|_| random.unit() - 0.5);
        let c = std::array::from_fn(|k| -a[k] * b[k] * [1.0, -1.0, 0.75][k % 3]);
        assert_rounded_once_or_twice([a, b, c]);
    }
}

/// Kernel for the masks of surely rounded numbers, in eight lanes and in sixteen.
struct Rounds([[f64; LANES]; 2]);

impl Kernel for Rounds {
    type Output = [u32; 2];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        /// Doubles from floats: the nearest float of each number, plus its remainder.
        #[inline(always)]
        fn doubles<S: Lanewise<N>, const N: usize>(s: S, row: &[f64; N]) -> S::Doubles {
            let nearest: [f32; N] = std::array::from_fn(|k| row[k] as f32);
            let rest: [f32; N] = std::array::from_fn(|k| (row[k] - f64::from(nearest[k])) as f32);
            s.add_f64(s.widen(s.load(&nearest)), s.widen(s.load(&rest)))
        }
        let both: [f64; WIDE] = std::array::from_fn(|k| self.0[k / LANES][k % LANES]);
        let eights = self.0.map(|row| s.rounds_surely(doubles(s, &row)));
        [eights[0] | eights[1] << LANES, s.wide().rounds_surely(doubles(s.wide(), &both))]
    }
}

#[test]
fn what_is_surely_rounded_is_so_wherever_the_number_is_within_its_error() {
    let mut random = Random::new(31);
    let (mut sure, mut near) = (0, 0);
    for case in 0..4000 {
        let mut rows = [[0.0; LANES]; 2];
        for (k, x) in rows.as_flattened_mut().iter_mut().enumerate() {
            let float = (random.unit() + 0.5) * 2f32.powi(random.below(200) as i32 - 100);
            let middle = (f64::from(float) + f64::from(float.next_up())) / 2.0;
            // Around the midpoint of two floats within the margin, farther from it, and at random.
            let size = match case % 3 {
                0 => middle * (1.0 + f64::from(random.cube().x) * 4.0 * ROUNDED),
                1 => middle * (1.0 + f64::from(random.cube().x) * 1e3 * ROUNDED),
                _ => f64::from(float) * (1.0 + f64::from(random.unit()) * 1e-7),
            };
            *x = if k % 2 == 0 { size } else { -size };
        }
        for level in Level::all() {
            let [eights, sixteen] = level.run(Rounds(rows));
            for (k, x) in rows.as_flattened().iter().enumerate() {
                // Doubles that are sums of two floats have 48 bits.
                let x = f64::from(*x as f32) + f64::from((*x - f64::from(*x as f32)) as f32);
                let one = (x * (1.0 - ROUNDED)) as f32 == (x * (1.0 + ROUNDED)) as f32;
                for mask in [eights, sixteen] {
                    let said = mask >> k & 1 == 1;
                    assert!(one || !said, "{x} on {}", level.name());
                    (sure, near) = (sure + usize::from(said), near + usize::from(!one));
                }
            }
        }
    }
    assert!(sure > near && near > 1000, "{sure} sure, {near} too near to tell");
}
