//! What the conventions say about a variable: sign, range, direction, order of axes.

use super::decode;
use crate::OpenOptions;
use crate::Raster;
use crate::input::FileBytes;

/// The classic format's types.
const CHAR: u32 = 2;
const SHORT: u32 = 3;
const DOUBLE: u32 = 6;

/// A name, a list or an attribute's bytes, padded to four.
fn padded(bytes: &[u8]) -> Vec<u8> {
    let mut all = bytes.to_vec();
    all.resize(bytes.len().next_multiple_of(4), 0);
    all
}

fn name(text: &str) -> Vec<u8> {
    [
        &(text.len() as u32).to_be_bytes()[..],
        &padded(text.as_bytes()),
    ]
    .concat()
}

/// An attribute: a text, or numbers of the type short.
enum Attribute {
    Text(&'static str, &'static str),
    Shorts(&'static str, Vec<i16>),
}

impl Attribute {
    fn bytes(&self) -> Vec<u8> {
        let (key, kind, count, value) = match self {
            Self::Text(key, text) => (key, CHAR, text.len(), text.as_bytes().to_vec()),
            Self::Shorts(key, values) => {
                let bytes = values.iter().flat_map(|value| value.to_be_bytes());
                (key, SHORT, values.len(), bytes.collect())
            }
        };
        let numbers = [kind.to_be_bytes(), (count as u32).to_be_bytes()].concat();
        [name(key), numbers, padded(&value)].concat()
    }
}

/// A variable of the file: its name, dimensions, attributes, type and values.
struct Variable {
    name: &'static str,
    dimensions: Vec<u32>,
    attributes: Vec<Attribute>,
    kind: u32,
    values: Vec<u8>,
}

fn coordinate(name: &'static str, dimension: u32, units: &'static str, values: &[f64]) -> Variable {
    Variable {
        name,
        dimensions: vec![dimension],
        attributes: vec![Attribute::Text("units", units)],
        kind: DOUBLE,
        values: values
            .iter()
            .flat_map(|value| value.to_be_bytes())
            .collect(),
    }
}

fn heights(dimensions: [u32; 2], values: &[i16], attributes: Vec<Attribute>) -> Variable {
    Variable {
        name: "z",
        dimensions: dimensions.to_vec(),
        attributes,
        kind: SHORT,
        values: values
            .iter()
            .flat_map(|value| value.to_be_bytes())
            .collect(),
    }
}

/// A classic file (CDF-1) of dimensions lat (2) and lon (3).
fn file(variables: &[Variable]) -> FileBytes {
    let list = |tag: u32, items: &[Vec<u8>]| match items.len() as u32 {
        0 => vec![0; 8],
        count => {
            let head = [tag.to_be_bytes(), count.to_be_bytes()].concat();
            [head, items.concat()].concat()
        }
    };
    let dimension = |text: &str, length: u32| [name(text), length.to_be_bytes().to_vec()].concat();
    let dimensions = list(10, &[dimension("lat", 2), dimension("lon", 3)]);
    let entry = |variable: &Variable, begin: u32| {
        let ids: Vec<u8> = variable
            .dimensions
            .iter()
            .flat_map(|id| id.to_be_bytes())
            .collect();
        let attributes: Vec<_> = variable.attributes.iter().map(Attribute::bytes).collect();
        let size = padded(&variable.values).len() as u32;
        [
            name(variable.name),
            (variable.dimensions.len() as u32).to_be_bytes().to_vec(),
            ids,
            list(12, &attributes),
            [variable.kind, size, begin].map(u32::to_be_bytes).concat(),
        ]
        .concat()
    };
    let header = |begins: &[u32]| {
        let entries = variables.iter().zip(begins);
        let entries: Vec<_> = entries
            .map(|(variable, begin)| entry(variable, *begin))
            .collect();
        [
            b"CDF\x01\0\0\0\0".to_vec(),
            dimensions.clone(),
            vec![0; 8],
            list(11, &entries),
        ]
        .concat()
    };
    let mut begin = header(&vec![0; variables.len()]).len() as u32;
    let begins: Vec<u32> = variables
        .iter()
        .map(|variable| {
            let here = begin;
            begin += padded(&variable.values).len() as u32;
            here
        })
        .collect();
    let values: Vec<u8> = variables.iter().flat_map(|v| padded(&v.values)).collect();
    FileBytes::unpacked("test.nc", [header(&begins), values].concat())
}

fn with_axes(z: Variable) -> Raster {
    let lat = coordinate("lat", 0, "degrees_north", &[50.0, 50.1]);
    let lon = coordinate("lon", 1, "degrees_east", &[8.0, 8.1, 8.2]);
    let decoded = decode(&file(&[lat, lon, z]), &OpenOptions::default()).expect("a grid");
    Raster::checked(decoded, None).expect("heights")
}

#[test]
fn signed_integers_that_are_called_unsigned_are() {
    let attributes = vec![
        Attribute::Text("_Unsigned", "true"),
        Attribute::Shorts("_FillValue", vec![-1]),
    ];
    let z = heights([0, 1], &[1, 2, 3, -1, -32768, 6], attributes);
    let raster = with_axes(z);
    assert_eq!(raster.height(1, 1), 32768.0);
    assert_eq!(raster.summary().holes, 1);
}

#[test]
fn integers_of_every_size_take_the_other_sign() {
    use crate::samples::{SampleValue, Samples, with_samples};
    for (stored, wanted) in [
        (Samples::I8(vec![-1]), 255.0),
        (Samples::U8(vec![255]), -1.0),
        (Samples::I16(vec![-1]), 65_535.0),
        (Samples::U16(vec![65_535]), -1.0),
        (Samples::I32(vec![-1]), 4_294_967_295.0),
        (Samples::U32(vec![u32::MAX]), -1.0),
        (Samples::F32(vec![-1.0]), -1.0),
    ] {
        let called = format!("{stored:?}");
        let found = super::of_the_other_sign(stored);
        let value = with_samples!(&found, values => values[0].widen());
        assert_eq!(value, wanted, "{called}");
    }
}

#[test]
fn what_is_out_of_the_valid_range_is_a_hole() {
    for attributes in [
        vec![Attribute::Shorts("valid_range", vec![2, 5])],
        vec![
            Attribute::Shorts("valid_min", vec![2]),
            Attribute::Shorts("valid_max", vec![5]),
        ],
    ] {
        let raster = with_axes(heights([0, 1], &[1, 2, 3, 4, 5, 6], attributes));
        assert_eq!(raster.summary().holes, 2);
        assert!(raster.height(0, 0).is_nan() && raster.height(2, 1).is_nan());
    }
}

#[test]
fn depths_are_heights_below_zero() {
    let down = vec![Attribute::Text("positive", "down")];
    let raster = with_axes(heights([0, 1], &[1, 2, 3, 4, 5, 6], down));
    assert_eq!(
        (raster.summary().lowest, raster.summary().highest),
        (-6.0, -1.0)
    );
    assert!(
        raster
            .remarks()
            .iter()
            .any(|remark| remark.contains("depths"))
    );
}

#[test]
fn a_grid_stored_column_by_column_is_turned_by_its_coordinates() {
    // (lon, lat): lat runs fastest.
    let raster = with_axes(heights([1, 0], &[1, 4, 2, 5, 3, 6], vec![]));
    assert_eq!((raster.columns(), raster.rows()), (3, 2));
    let rows = [0, 1].map(|row| [0, 1, 2].map(|column| raster.height(column, row)));
    assert_eq!(rows, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
}
