//! The building blocks against the unit vectors of `conformance/unit`.

use crate::known::{read_json, Json};
use quarc::arithmetic::{bit_length, divide_round, isqrt, Divisor};
use quarc::coding::counts::{Counts, Model, Seen};
use quarc::coding::numbers::{code_ascending, code_numbers};
use quarc::coding::planes::PlaneReader;
use quarc::coding::probability::{choose_code, weight_of_code};
use quarc::coding::sequence::{Sequence, KEY_CLASS_BITS};
use quarc::coding::words::WordReader;
use quarc::digest::Serialized;
use quarc::error::{Error, Reject};
use quarc::rotation::{expand, normalize_sum, turn, turn_batch, Residuals};
use quarc::rows::Rows;
use quarc::state::choose_deaths;

/// Check a function against all of its unit vectors, rejections included.
fn check(function: &str, answer: impl Fn(&Json) -> Result<Json, Error>) {
    let file = read_json(&format!("unit/{function}.json"));
    assert!(!file.get("cases").list().is_empty());
    for case in file.get("cases").list() {
        match answer(case.get("input")) {
            Ok(output) => assert_eq!(plain(&output), plain(case.get("output")), "{case:?}"),
            Err(error) => {
                let id = error.reject().map(Reject::id);
                assert_eq!(id, Some(case.get("refused").text()), "{case:?}");
            }
        }
    }
}

/// Convert numbers that are written as texts.
fn plain(json: &Json) -> Json {
    match json {
        Json::Text(text) => text.parse().map_or_else(|_| json.clone(), Json::Number),
        Json::List(items) => Json::List(items.iter().map(plain).collect()),
        other => other.clone(),
    }
}

fn number(number: impl Into<i128>) -> Json {
    Json::Number(number.into())
}

fn numbers<T: Into<i128>>(numbers: impl IntoIterator<Item = T>) -> Json {
    Json::List(numbers.into_iter().map(number).collect())
}

fn four(json: &Json) -> [i32; 4] {
    json.i32s().try_into().expect("four numbers")
}

/// Rows from a list of points.
fn rows<T: Copy + Default>(points: &Json, narrow: impl Fn(i32) -> T) -> Rows<T> {
    let points: Vec<Vec<i32>> = points.list().iter().map(Json::i32s).collect();
    let mut rows = Rows::zeros(points[0].len(), points.len(), 0);
    for (column, point) in points.iter().enumerate() {
        for (row, &number) in point.iter().enumerate() {
            rows.row_mut(row)[column] = narrow(number);
        }
    }
    rows
}

#[test]
fn arithmetic() {
    check("divide_round", |input| {
        let (n, d) = (input.get("n").number(), input.get("d").number());
        let quotient = divide_round(n as i64, d as i64);
        if d < 1 << 31 && quotient.abs() < 1 << 24 {
            assert_eq!(Divisor::new(d as i64).divide_round(n as i64), quotient);
        }
        Ok(number(quotient))
    });
    check("isqrt", |input| Ok(number(isqrt(input.get("v").number() as i64))));
    check("bit_length", |input| Ok(number(bit_length(input.get("v").number() as u64))));
}

#[test]
fn quotients_near_a_half_are_rounded_correctly() {
    for divisor in [1, 2, 3, 255, 4_194_303, 4_194_304, (1 << 30) + 1, (1 << 31) - 1] {
        for quotient in [0, 1, 2, 4_194_303, 4_194_304, (1 << 24) - 2] {
            for near in [0, divisor / 2, (divisor + 1) / 2, divisor - 1] {
                for n in [quotient * divisor + near, -(quotient * divisor + near)] {
                    let due = divide_round(n, divisor);
                    assert_eq!(Divisor::new(divisor).divide_round(n), due, "{n} / {divisor}");
                }
            }
        }
    }
}

#[test]
fn rotations() {
    check("normalize", |input| Ok(numbers(normalize_sum(four(input.get("vector")))?)));
    check("turn", |input| {
        let mut residuals = Residuals::default();
        let residual = residuals.of(four(input.get("sums")))?;
        assert_eq!(residuals.of(four(input.get("sums"))), Ok(residual), "the cached result");
        Ok(numbers(turn(four(input.get("rotation")), residual)?))
    });
    check("expand", |input| {
        let [a, b, c]: [i32; 3] = input.get("abc").i32s().try_into().expect("three");
        let coded = [input.get("j").number() as i32, a, b, c];
        Ok(numbers(expand(coded, input.get("rotation_bits").number() as u8)?))
    });
}

#[test]
fn deaths() {
    check("deaths", |input| {
        let opacities: Vec<i16> =
            input.get("opacities").i32s().iter().map(|&code| code as i16).collect();
        Ok(numbers(choose_deaths(&opacities, input.get("count").number() as u32)))
    });
}

#[test]
fn probabilities() {
    check("weight_of_code", |input| Ok(number(weight_of_code(input.get("code").number() as u8)?)));
    check("weight_by_counts", |input| {
        let count = |name| input.get(name).number() as u64;
        Ok(number(Seen::default().after(count("zeros"), count("ones")).weight()))
    });
    check("counts", |input| {
        let pair = |name| input.get(name).u32s();
        let after = |seen: Seen, more: &[u32]| seen.after(more[0].into(), more[1].into());
        let seen = after(after(Seen::default(), &pair("before")), &pair("plane"));
        Ok(numbers([seen.zeros, seen.ones]))
    });
}

#[test]
fn the_nearest_code_is_chosen() {
    for (ones, count) in [(0, 1), (1, 1), (1, 2), (1, 3), (2, 3), (1, 1000), (70_000, 70_001)] {
        let share = (ones << 24) / count;
        let weight = |code: u8| u64::from(weight_of_code(code).expect("a code"));
        let nearest = (0..240).map(|code| weight(code).abs_diff(share)).min();
        let (code, chosen) = choose_code(ones, count);
        assert_eq!(weight(code), chosen.into());
        assert_eq!(Some(weight(code).abs_diff(share)), nearest);
    }
}

#[test]
fn words() {
    check("decode_bits", |input| {
        let words = input.get("words").u32s();
        let mut reader = WordReader::new(&words)?;
        let bits: Vec<u8> =
            input.get("weights").u32s().iter().map(|&w| u8::from(reader.take(w))).collect();
        reader.finish()?;
        Ok(numbers(bits))
    });
}

/// Read a sequence of numbers, with counts that start at 0.
fn read_numbers(input: &Json, form: impl Fn(usize, u32) -> Sequence) -> Result<Json, Error> {
    let contexts: Vec<u16> = input.get("contexts").u32s().iter().map(|&c| c as u16).collect();
    let outer = 1 + usize::from(*contexts.iter().max().expect("a number"));
    let sequence = form(outer, input.get("width").number() as u32);
    let (words, mut counts) = (input.get("words").u32s(), Counts::new(sequence.end()));
    let mut reader = PlaneReader::new(&words, &mut counts)?;
    let mut answers = vec![0; contexts.len()];
    code_numbers(&mut reader, &sequence, &contexts, &mut answers)?;
    reader.finish()?;
    Ok(numbers(answers))
}

#[test]
fn integers_as_planes() {
    check("fixed", |input| read_numbers(input, |outer, width| Sequence::fixed(0, outer, width)));
    check("unsigned", |input| {
        read_numbers(input, |outer, width| Sequence::unsigned(0, outer, width))
    });
    check("signed", |input| read_numbers(input, |outer, width| Sequence::signed(0, outer, width)));
    check("ascending", |input| {
        let sequence = Sequence::unsigned(0, 1, KEY_CLASS_BITS);
        let (words, mut counts) = (input.get("words").u32s(), Counts::new(sequence.end()));
        let mut reader = PlaneReader::new(&words, &mut counts)?;
        let mut answers = vec![0; input.get("count").number() as usize];
        code_ascending(&mut reader, &sequence, &mut answers, (1 << 61, Reject::SymbolRange))?;
        reader.finish()?;
        Ok(numbers(answers))
    });
}

#[test]
fn counts_are_added_to_the_right_context() {
    let mut counts = Counts::new(5);
    counts.learn(Model::at(2), 1, 1, 2);
    assert_eq!(counts.of(Model::at(0), 3), Seen { zeros: 1, ones: 2 });
    assert_eq!(counts.of(Model::at(2), 2), Seen::default());
}

#[test]
fn digests() {
    check("digest", |input| {
        let ids = input.get("ids").u32s();
        let serialized = Serialized {
            phase: input.get("phase").number() as u32,
            ids: &ids,
            positions: &rows(input.get("positions"), |number| number),
            rotations: &rows(input.get("rotations"), |number| number),
            codes: &rows(input.get("codes"), |number| number as i16),
        };
        let answer = [
            ("crc_all", number(serialized.crc(true))),
            ("crc_without_codes", number(serialized.crc(false))),
            ("sha256", Json::Text(serialized.digest())),
        ];
        Ok(Json::Object(answer.map(|(name, value)| (name.to_string(), value)).into()))
    });
}

#[test]
fn products_are_normalized_as_the_text_says() {
    // Normalize a vector exactly as 7.3 says.
    let by_the_text = |vector: [i32; 4]| {
        let squares: i64 = vector.iter().map(|&part| i64::from(part) * i64::from(part)).sum();
        let norm = isqrt(squares << 16);
        vector.map(|part| divide_round(i64::from(part) << 30, norm) as i32)
    };
    let mut seed = 1u64;
    let mut some = |below: i64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((seed >> 33) as i64 % below) as i32
    };
    for _ in 0..200_000 {
        let sum = [some(1000) - 200, some(400) - 200, some(400) - 200, some(200) - 100];
        let near = |part| part + some(5) - 2;
        let vector =
            normalize_sum(if sum == [0; 4] { [1; 4] } else { sum }).expect("no zero").map(near);
        // A product with 1 changes a quaternion only in its norm.
        assert_eq!(turn(vector, [1 << 22, 0, 0, 0]), Ok(by_the_text(vector)), "{vector:?}");
    }
    let far = [5_000_000, -4_000_000, 3, 77];
    assert_eq!(turn(far, [1 << 22, 0, 0, 0]), Ok(by_the_text(far)));
}

#[test]
fn rotations_turned_together_are_those_turned_alone() {
    let ones: [i32; 4] = [1 << 22, 0, 0, 0];
    let residual = normalize_sum([9, -2, 5, 1]).expect("no zero");
    let near = normalize_sum([-7, 300, 12, 5]).expect("no zero");
    let far = [5_000_000, -4_000_000, 3, 77]; // not a unit quaternion
    for rotations in [[near, residual, ones], [near, far, residual]] {
        let residuals = [residual, ones, near];
        let mut batch = [0, 1, 2, 3].map(|row: usize| rotations.map(|rotation| rotation[row]));
        let by = [0, 1, 2, 3].map(|row: usize| residuals.map(|residual| residual[row]));
        turn_batch(&mut batch, &by).expect("no zero");
        for (lane, (rotation, residual)) in rotations.into_iter().zip(residuals).enumerate() {
            assert_eq!(Ok(batch.map(|row| row[lane])), turn(rotation, residual));
        }
    }
}
