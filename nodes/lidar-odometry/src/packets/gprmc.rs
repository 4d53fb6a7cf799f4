//! The sentence `RMC` of NMEA 0183: time, position, speed and course of a GPS receiver.

use geometry::Stamp;

/// The sentence of a receiver; `None` where it left a field empty, as it does without a fix.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gprmc {
    /// Whether the receiver vouches for the position.
    pub valid: bool,
    /// UTC, in nanoseconds since 1970; `None` without time or date. Two digits of a year are 1980 to 2079.
    pub time: Option<Stamp>,
    /// North of the equator.
    pub latitude_deg: Option<f64>,
    /// East of Greenwich.
    pub longitude_deg: Option<f64>,
    /// Over ground.
    pub speed_m_per_s: Option<f64>,
    /// Clockwise from true north.
    pub course_deg: Option<f64>,
}

/// Why a sentence is not read.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum GprmcError {
    /// Another sentence, or none.
    #[error("'{start}' does not begin a sentence $..RMC")]
    NotRmc {
        /// The first characters.
        start: String,
    },
    /// The sentence has no checksum, or is cut off before it.
    #[error("the sentence ends without a checksum after {length} bytes")]
    NoChecksum {
        /// Bytes of the sentence.
        length: usize,
    },
    /// The checksum is that of another sentence.
    #[error("the sentence states the checksum {stated:#04x}, and has {computed:#04x}")]
    Checksum {
        /// The checksum at its end.
        stated: u8,
        /// The checksum of its characters.
        computed: u8,
    },
    /// A field is no number, or beyond its range.
    #[error("field {field} of the sentence, '{text}', cannot be read")]
    Field {
        /// Which field, 0 for the sentence's name.
        field: usize,
        /// The text there.
        text: String,
    },
}

/// Metres a second in a knot: 1852 m an hour.
const KNOT_M_PER_S: f64 = 1852.0 / 3600.0;

impl Gprmc {
    /// The sentence without its line end.
    ///
    /// # Errors
    /// When it is another sentence, its checksum does not hold, or a field cannot be read.
    pub fn parse(sentence: &[u8]) -> Result<Self, GprmcError> {
        let text = String::from_utf8_lossy(sentence);
        let shortened = |text: &str| text.chars().take(16).collect::<String>();
        let is_rmc = text.starts_with('$') && text.get(3..6) == Some("RMC");
        if !is_rmc {
            return Err(GprmcError::NotRmc { start: shortened(&text) });
        }
        let no_checksum = GprmcError::NoChecksum { length: sentence.len() };
        let (body, stated) =
            text.get(1..).unwrap_or_default().split_once('*').ok_or(no_checksum)?;
        let stated = stated.get(..2).and_then(|digits| u8::from_str_radix(digits, 16).ok());
        let stated = stated.ok_or(GprmcError::NoChecksum { length: sentence.len() })?;
        let computed = body.bytes().fold(0, |sum, byte| sum ^ byte);
        if stated != computed {
            return Err(GprmcError::Checksum { stated, computed });
        }
        let fields = Fields(body.split(',').collect());
        let time = fields.time_of_day_ns(1)?.zip(fields.date_days(9)?);
        Ok(Self {
            valid: fields.text(2) == "A",
            time: time.map(|(of_day_ns, days)| Stamp::from_nanos(days * DAY_NS + of_day_ns)),
            latitude_deg: fields.angle_deg(3, 2, ["N", "S"], 90.0)?,
            longitude_deg: fields.angle_deg(5, 3, ["E", "W"], 180.0)?,
            speed_m_per_s: fields.number(7)?.map(|knots| knots * KNOT_M_PER_S),
            course_deg: fields.number(8)?,
        })
    }
}

const SECOND_NS: i64 = 1_000_000_000;
const DAY_NS: i64 = 86_400 * SECOND_NS;

struct Fields<'a>(Vec<&'a str>);

impl<'a> Fields<'a> {
    fn text(&self, field: usize) -> &'a str {
        self.0.get(field).copied().unwrap_or_default()
    }

    fn error(&self, field: usize) -> GprmcError {
        GprmcError::Field { field, text: self.text(field).chars().take(16).collect() }
    }

    fn number(&self, field: usize) -> Result<Option<f64>, GprmcError> {
        let text = self.text(field);
        if text.is_empty() {
            return Ok(None);
        }
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        number.map(Some).ok_or_else(|| self.error(field))
    }

    /// Two digits at a place of a field.
    fn pair(&self, field: usize, at: usize) -> Result<i64, GprmcError> {
        let digits = self.text(field).get(at..at + 2);
        let digits = digits.filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()));
        digits.and_then(|digits| digits.parse().ok()).ok_or_else(|| self.error(field))
    }

    /// `hhmmss.ss`.
    fn time_of_day_ns(&self, field: usize) -> Result<Option<i64>, GprmcError> {
        if self.text(field).is_empty() {
            return Ok(None);
        }
        let (hours, minutes) = (self.pair(field, 0)?, self.pair(field, 2)?);
        let seconds = self.text(field).get(4..).and_then(|text| text.parse::<f64>().ok());
        // A leap second is the 60th.
        let seconds = seconds.filter(|seconds| (0.0..61.0).contains(seconds));
        let seconds = seconds.ok_or_else(|| self.error(field))?;
        if hours > 23 || minutes > 59 {
            return Err(self.error(field));
        }
        let fraction_ns = (seconds * SECOND_NS as f64).round() as i64;
        Ok(Some((hours * 3600 + minutes * 60) * SECOND_NS + fraction_ns))
    }

    /// `ddmmyy` as days since 1970.
    fn date_days(&self, field: usize) -> Result<Option<i64>, GprmcError> {
        if self.text(field).is_empty() {
            return Ok(None);
        }
        let (day, month, year) = (self.pair(field, 0)?, self.pair(field, 2)?, self.pair(field, 4)?);
        if !(1..=31).contains(&day) || !(1..=12).contains(&month) {
            return Err(self.error(field));
        }
        let year = if year < 80 { 2000 + year } else { 1900 + year };
        Ok(Some(days_since_1970(year, month, day)))
    }

    /// Degrees with this many digits, minutes with a fraction; the field after it gives the hemisphere.
    fn angle_deg(
        &self,
        field: usize,
        degree_digits: usize,
        [positive, negative]: [&str; 2],
        limit_deg: f64,
    ) -> Result<Option<f64>, GprmcError> {
        let text = self.text(field);
        if text.is_empty() {
            return Ok(None);
        }
        let number = |text: Option<&str>| text?.parse::<f64>().ok();
        let parts = number(text.get(..degree_digits)).zip(number(text.get(degree_digits..)));
        let angle_deg = parts.map(|(degrees, minutes)| degrees + minutes / 60.0);
        let angle_deg = angle_deg.filter(|angle_deg| (0.0..=limit_deg).contains(angle_deg));
        let angle_deg = angle_deg.ok_or_else(|| self.error(field))?;
        match self.text(field + 1) {
            side if side == positive => Ok(Some(angle_deg)),
            side if side == negative => Ok(Some(-angle_deg)),
            _ => Err(self.error(field + 1)),
        }
    }
}

/// Days of the Gregorian calendar since 1970-01-01, for years from 1970 on. The year begins with March, so that the
/// leap day is its last.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    /// From the March before the year 0 to 1970-01-01.
    const TO_1970: i64 = 719_468;
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    // Months from March on have 31, 30, 31, 30, 31 days again and again.
    let of_year = (153 * month + 2) / 5 + day - 1;
    365 * year + year / 4 - year / 100 + year / 400 + of_year - TO_1970
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_checksum(body: &str) -> Vec<u8> {
        let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
        format!("${body}*{sum:02X}").into_bytes()
    }

    #[test]
    fn a_sentence_is_read() {
        let body = "GPRMC,081802.25,A,3649.7478558,N,00224.4542928,W,10,212.5,210116,0.0,E,A";
        let sentence = Gprmc::parse(&with_checksum(body)).unwrap();
        assert!(sentence.valid);
        assert_eq!(sentence.time.unwrap(), Stamp::from_secs_nanos(1_453_364_282, 250_000_000));
        assert!((sentence.latitude_deg.unwrap() - (36.0 + 49.747_855_8 / 60.0)).abs() < 1e-12);
        assert!((sentence.longitude_deg.unwrap() + (2.0 + 24.454_292_8 / 60.0)).abs() < 1e-12);
        assert!((sentence.speed_m_per_s.unwrap() - 5.144_444).abs() < 1e-6);
        assert_eq!(sentence.course_deg, Some(212.5));
    }

    #[test]
    fn a_receiver_without_a_fix_leaves_fields_empty() {
        let sentence = Gprmc::parse(&with_checksum("GNRMC,,V,,,,,,,,,,N")).unwrap();
        let empty = Gprmc {
            valid: false,
            time: None,
            latitude_deg: None,
            longitude_deg: None,
            speed_m_per_s: None,
            course_deg: None,
        };
        assert_eq!(sentence, empty);
    }

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (year, month, day, days) in [
            (1970, 1, 1, 0),
            (1970, 12, 31, 364),
            (2000, 2, 29, 11_016),
            (2000, 3, 1, 11_017),
            (2016, 1, 21, 16_821),
            (2079, 12, 31, 40_176),
        ] {
            assert_eq!(days_since_1970(year, month, day), days, "{year}-{month}-{day}");
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let message = |sentence: &[u8]| Gprmc::parse(sentence).unwrap_err().to_string();
        assert!(message(b"$GPGGA,1*00").contains("'$GPGGA,1*00'"));
        assert!(message(b"$GPRMC,081802").contains("without a checksum after 13 bytes"));
        assert!(message(b"$GPRMC,*00").contains("states the checksum 0x00"));
        for (body, part) in [
            ("GPRMC,081802,A,3649.7,N,00224.4,W,x,212.5,210116", "field 7 of the sentence, 'x'"),
            ("GPRMC,251802,A,,,,,,,210116", "field 1"),
            ("GPRMC,08,A,,,,,,,210116", "field 1"),
            ("GPRMC,081802,A,9949.7,N,,,,,210116", "field 3"),
            ("GPRMC,081802,A,3649.7,Q,,,,,210116", "field 4"),
            ("GPRMC,081802,A,,,,,,,211316", "field 9"),
        ] {
            let error = message(&with_checksum(body));
            assert!(error.contains(part), "{error}");
        }
    }
}
