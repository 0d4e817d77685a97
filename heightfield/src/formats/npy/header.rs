//! The header of a NumPy array: a Python dictionary of three keys. No other Python syntax is read,
//! so the time is linear in the header's bytes.

use std::io::Read;

use crate::RasterError;

/// Max size of a header, bytes; real ones have 128.
const MAX_BYTES: u64 = 1 << 16;
/// Max number of dimensions.
const MAX_SIDES: usize = 32;

/// Content of a header.
#[derive(Debug, PartialEq)]
pub(super) struct Header {
    /// Byte order, kind and bytes of a sample, as `<f4`.
    pub(super) descr: String,
    /// True if the first index varies fastest.
    pub(super) column_major: bool,
    pub(super) shape: Vec<u64>,
    /// Bytes before the samples.
    pub(super) bytes: u64,
}

impl Header {
    /// Reads the header at the beginning of a file.
    ///
    /// # Errors
    /// [`RasterError::NoNumbers`] for records; the part that differs from NumPy's format.
    pub(super) fn read(reader: &mut dyn Read) -> Result<Self, RasterError> {
        let cut = |error| RasterError::from_io(error, "the array's header");
        let mut head = [0; 8];
        reader.read_exact(&mut head).map_err(cut)?;
        let (begins, long) = match head[6] {
            1 => {
                let mut long = [0; 2];
                reader.read_exact(&mut long).map_err(cut)?;
                (10, u64::from(u16::from_le_bytes(long)))
            }
            2 | 3 => {
                let mut long = [0; 4];
                reader.read_exact(&mut long).map_err(cut)?;
                (12, u64::from(u32::from_le_bytes(long)))
            }
            version => return Err(unfamiliar(&format!("version {version}"))),
        };
        if long > MAX_BYTES {
            return Err(RasterError::AbsurdSize(format!(
                "an array header of {long} bytes"
            )));
        }
        let mut text = vec![0; long as usize];
        reader.read_exact(&mut text).map_err(cut)?;
        let text = String::from_utf8_lossy(&text);
        Self::parse(&text, begins + long)
    }

    fn parse(text: &str, bytes: u64) -> Result<Self, RasterError> {
        let mut parser = Parser(text);
        let (mut descr, mut order, mut shape) = (None, None, None);
        parser.expect("{")?;
        while !parser.skip("}") {
            let key = parser.text()?;
            parser.expect(":")?;
            match key {
                "descr" => descr = Some(parser.descr()?.to_owned()),
                "fortran_order" => order = Some(parser.truth()?),
                "shape" => shape = Some(parser.sides()?),
                key => return Err(unfamiliar(&format!("the key {key:?}"))),
            }
            if !parser.skip(",") {
                parser.expect("}")?;
                break;
            }
        }
        let (Some(descr), Some(column_major), Some(shape)) = (descr, order, shape) else {
            return Err(unfamiliar("no descr, fortran_order or shape"));
        };
        Ok(Self {
            descr,
            column_major,
            shape,
            bytes,
        })
    }
}

fn unfamiliar(what: &str) -> RasterError {
    RasterError::NotAHeightField(format!("an array whose header has {what}"))
}

/// Rest of a header.
struct Parser<'t>(&'t str);

impl<'t> Parser<'t> {
    /// Returns true if a sign is next, and skips it.
    fn skip(&mut self, sign: &str) -> bool {
        let rest = self.0.trim_start();
        let after = rest.strip_prefix(sign);
        self.0 = after.unwrap_or(rest);
        after.is_some()
    }

    fn expect(&mut self, sign: &str) -> Result<(), RasterError> {
        match self.skip(sign) {
            true => Ok(()),
            false => {
                let found: String = self.0.chars().take(12).collect();
                Err(unfamiliar(&format!("{found:?} in the place of {sign:?}")))
            }
        }
    }

    /// Reads a quoted text.
    fn text(&mut self) -> Result<&'t str, RasterError> {
        let quote = if self.skip("\"") { '"' } else { '\'' };
        if quote == '\'' {
            self.expect("'")?;
        }
        let (text, rest) = self
            .0
            .split_once(quote)
            .ok_or_else(|| unfamiliar("a text without an end"))?;
        self.0 = rest;
        Ok(text)
    }

    /// Reads the type of a sample; records have a list.
    fn descr(&mut self) -> Result<&'t str, RasterError> {
        match self.skip("[") {
            true => Err(RasterError::NoNumbers("an array of records".into())),
            false => self.text(),
        }
    }

    fn truth(&mut self) -> Result<bool, RasterError> {
        match self.skip("True") {
            true => Ok(true),
            false => self.expect("False").map(|()| false),
        }
    }

    /// Reads dimensions, as `(2, 3)`.
    fn sides(&mut self) -> Result<Vec<u64>, RasterError> {
        let mut sides = Vec::new();
        self.expect("(")?;
        while !self.skip(")") {
            let rest = self.0.trim_start();
            let end = rest
                .find(|c: char| !c.is_ascii_digit())
                .unwrap_or(rest.len());
            let (side, rest) = rest.split_at(end);
            let side = side.parse();
            sides.push(side.map_err(|_| RasterError::AbsurdSize("an array's side".into()))?);
            if sides.len() > MAX_SIDES {
                return Err(unfamiliar(&format!("more than {MAX_SIDES} sides")));
            }
            // Python 2 wrote long integers so.
            self.0 = rest.strip_prefix('L').unwrap_or(rest);
            if !self.skip(",") {
                self.expect(")")?;
                break;
            }
        }
        Ok(sides)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Header, RasterError> {
        Header::parse(text, 128)
    }

    #[test]
    fn headers_of_python_2_and_3_are_read() {
        for text in [
            "{'descr': '>i2', 'fortran_order': True, 'shape': (2, 3), }  \n",
            "{\"shape\":(2L,3L),\"descr\":\">i2\",\"fortran_order\":True}",
        ] {
            let header = parsed(text).expect("a header");
            assert_eq!((header.descr.as_str(), header.column_major), (">i2", true));
            assert_eq!(header.shape, [2, 3]);
        }
        let none = parsed("{'descr': '<f4', 'fortran_order': False, 'shape': (), }");
        assert!(none.expect("a scalar").shape.is_empty());
    }

    #[test]
    fn other_python_is_refused() {
        for text in [
            "",
            "{",
            "{'descr'",
            "{'descr': {'a': {",
            "{'descr': '<f4', 'fortran_order': 0, 'shape': (2, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': [2, 3]}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': ((2, 3))}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-2, 3)}",
            "{'descr': '<f4', 'fortran_order': False}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), 'x': {{{{",
        ] {
            parsed(text).expect_err(text);
        }
        let records = parsed("{'descr': [('a', '<f4')], ");
        assert!(
            matches!(records, Err(RasterError::NoNumbers(_))),
            "{records:?}"
        );
    }
}
