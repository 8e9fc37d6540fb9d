//! Every level rounds, compares and moves as plain numbers do.

use super::*;

const HARD: [f32; 10] =
    [0.0, -0.0, 1.0, -3.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-42, f32::MAX, f32::MIN_POSITIVE];

/// The sign and payload of a NaN are nobody's business.
fn bits(x: f32) -> u64 {
    u64::from(if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() })
}

fn bits_f64(x: f64) -> u64 {
    if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }
}

/// All that is done with lanes, as bits. `mask` is some lanes.
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

    let (mut mixed, mut words) = (rows[1], rows[1].map(f32::to_bits));
    s.put(mask, a, &mut mixed);
    s.put_word(mask, 7, &mut words);
    all.extend(mixed.map(bits));
    all.extend(words.map(u64::from));
    all.push(u64::from(s.find_word(7, &words)));

    let third = s.splat_f64(1.0 / 3.0);
    let c = s.mul_f64(s.widen(a), third);
    let mut doubles = rows[1].map(f64::from);
    let d = s.load_f64(&doubles);
    let results = [
        s.add_f64(c, d),
        s.sub_f64(c, d),
        s.mul_f64(c, d),
        s.div_f64(c, d),
        s.abs_f64(c),
        s.greater_f64(c, d),
        s.smaller_f64(c, d),
        s.widen(s.narrow(c)),
    ];
    all.extend(results.into_iter().flat_map(|r| s.store_f64(r)).map(bits_f64));
    all.push(u64::from(s.less_f64(c, d)));
    s.put_f64(mask, c, &mut doubles);
    all.extend(doubles.map(bits_f64));
    all
}

/// The same by plain numbers, one lane after another.
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
    all.push((0..N).fold(0, |m, k| m | u64::from(c[k] < d[k]) << k));
    all.extend((0..N).map(|k| bits_f64(if chosen(k) { c[k] } else { d[k] })));
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

struct Broad([[f32; WIDE]; 2], u32);

impl Kernel for Broad {
    type Output = Vec<u64>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Vec<u64> {
        everything(s.wide(), &self.0, self.1)
    }
}

#[test]
fn every_level_computes_like_plain_numbers() {
    for (i, &x) in HARD.iter().enumerate() {
        for (j, &y) in HARD.iter().enumerate() {
            let a: [f32; WIDE] = std::array::from_fn(|k| HARD[(i + k) % HARD.len()]);
            let b: [f32; WIDE] = std::array::from_fn(|k| if k % 2 == 0 { x } else { y });
            let mask = (0x9e37_79b9_u32).rotate_left((10 * i + j) as u32) & 0xffff;
            let first = [*a.first_chunk().unwrap(), *b.first_chunk().unwrap()];
            for level in Level::all() {
                let name = level.name();
                assert_eq!(level.run(Broad([a, b], mask)), plainly(&[a, b], mask), "{name} {a:?} {b:?} {mask:x}");
                let eight = plainly::<LANES>(&first, mask & 0xff);
                assert_eq!(level.run(Narrow(first, mask & 0xff)), eight, "{name} {first:?} {mask:x}");
            }
        }
    }
}

/// Least and greatest of all lanes.
struct Ends([f32; WIDE]);

impl Kernel for Ends {
    type Output = [f32; 4];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> [f32; 4] {
        let (w, all) = (s.wide(), s.wide().load(&self.0));
        let eight = s.load(self.0.first_chunk().unwrap());
        [w.least(all), w.greatest(all), s.least(eight), s.greatest(eight)]
    }
}

#[test]
fn the_ends_of_a_row_are_found_wherever_they_stand() {
    for low in 0..WIDE {
        for high in (0..WIDE).filter(|&high| high != low) {
            let mut row: [f32; WIDE] = std::array::from_fn(|k| k as f32);
            (row[low], row[high]) = (-5.0, 50.0);
            let ends = |row: &[f32]| {
                [row.iter().copied().fold(f32::INFINITY, f32::min), row.iter().copied().fold(0.0, f32::max)]
            };
            let expected = [ends(&row), ends(&row[..LANES])].concat();
            for level in Level::all() {
                assert_eq!(level.run(Ends(row))[..], expected, "{}", level.name());
            }
        }
    }
}

/// Rows as columns, and back; a row in another order; one of six rows.
struct Moved([[f32; 4]; LANES]);

impl Kernel for Moved {
    type Output = (Vec<Row>, [[f32; 4]; LANES], Row, [u32; LANES], Row);

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let columns = s.columns(&self.0);
        let order = 0x0706_0102_0005_0304;
        let (mut arranged, mut words) = ([0.0; LANES], [0; LANES]);
        s.arrange(columns[1], order, &mut arranged);
        s.arrange_words(&s.store(columns[2]).map(f32::to_bits), order, &mut words);
        s.prefetch(&self.0);
        let mut rows = [s.store(columns[0]); 6];
        rows[4] = s.store(columns[3]);
        let picked = s.store(s.pick(&rows, Pick::new(4)));
        (columns.into_iter().map(|c| s.store(c)).collect(), s.rows(columns), arranged, words, picked)
    }
}

#[test]
fn every_level_moves_numbers_to_the_same_places() {
    let rows: [[f32; 4]; LANES] = std::array::from_fn(|i| std::array::from_fn(|k| (4 * i + k) as f32));
    let order = [4, 3, 5, 0, 2, 1, 6, 7];
    for level in Level::all() {
        let (columns, back, arranged, words, picked) = level.run(Moved(rows));
        assert!((0..32).all(|i| columns[i % 4][i / 4] == rows[i / 4][i % 4]), "{}", level.name());
        assert_eq!(back, rows, "{}", level.name());
        assert_eq!(arranged, order.map(|lane| rows[lane][1]), "{}", level.name());
        assert_eq!(words, order.map(|lane: usize| rows[lane][2].to_bits()), "{}", level.name());
        assert_eq!(picked[..], columns[3], "{}", level.name());
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
