//! The rows of which there are many, as JSON: byte for byte what serde writes, in a third of the time.
//!
//! Every field is named once here; a field that is added to a row does not compile until it is.

use common::record::{AchievedRow, MessageRow, StateRow};

/// Appends to a buffer.
struct Object<'b> {
    json: &'b mut Vec<u8>,
    integer: itoa::Buffer,
    number: zmij::Buffer,
}

impl Object<'_> {
    fn text(&mut self, key: &str, value: &str) -> &mut Self {
        self.json.extend_from_slice(key.as_bytes());
        if value.bytes().all(|b| (0x20..0x7f).contains(&b) && b != b'"' && b != b'\\') {
            self.json.push(b'"');
            self.json.extend_from_slice(value.as_bytes());
            self.json.push(b'"');
        } else {
            // It cannot fail: the value is text and the buffer grows.
            let _ = serde_json::to_writer(&mut *self.json, value);
        }
        self
    }

    fn integer(&mut self, key: &str, value: impl itoa::Integer) -> &mut Self {
        self.json.extend_from_slice(key.as_bytes());
        self.json.extend_from_slice(self.integer.format(value).as_bytes());
        self
    }

    /// A finite number.
    fn number(&mut self, key: &str, value: f64) -> &mut Self {
        self.json.extend_from_slice(key.as_bytes());
        self.json.extend_from_slice(self.number.format_finite(value).as_bytes());
        self
    }

    fn end(&mut self) {
        self.json.push(b'}');
    }
}

fn object(json: &mut Vec<u8>) -> Object<'_> {
    Object { json, integer: itoa::Buffer::new(), number: zmij::Buffer::new() }
}

/// Appends a state, whose numbers are finite.
pub(super) fn state(row: &StateRow, json: &mut Vec<u8>) {
    let StateRow {
        t_ns,
        vehicle,
        xi,
        xi_rate,
        v_ref,
        x_m,
        y_m,
        z_m,
        yaw_rad,
        pitch_rad,
        roll_rad,
        speed_mps,
        e_along_m,
        e_cross_m,
        e_norm_m,
        psi_e_rad,
        neighbours,
    } = row;
    object(json)
        .integer("{\"t_ns\":", *t_ns)
        .text(",\"vehicle\":", vehicle)
        .number(",\"xi\":", *xi)
        .number(",\"xi_rate\":", *xi_rate)
        .number(",\"v_ref\":", *v_ref)
        .number(",\"x_m\":", *x_m)
        .number(",\"y_m\":", *y_m)
        .number(",\"z_m\":", *z_m)
        .number(",\"yaw_rad\":", *yaw_rad)
        .number(",\"pitch_rad\":", *pitch_rad)
        .number(",\"roll_rad\":", *roll_rad)
        .number(",\"speed_mps\":", *speed_mps)
        .number(",\"e_along_m\":", *e_along_m)
        .number(",\"e_cross_m\":", *e_cross_m)
        .number(",\"e_norm_m\":", *e_norm_m)
        .number(",\"psi_e_rad\":", *psi_e_rad)
        .integer(",\"neighbours\":", *neighbours)
        .end();
}

/// Appends what became of a message.
pub(super) fn message(row: &MessageRow, json: &mut Vec<u8>) {
    let MessageRow { t_ns, from, to, seq, sent_ns, due_ns, fate } = row;
    object(json)
        .integer("{\"t_ns\":", *t_ns)
        .text(",\"from\":", from)
        .text(",\"to\":", to)
        .integer(",\"seq\":", *seq)
        .integer(",\"sent_ns\":", *sent_ns)
        .integer(",\"due_ns\":", *due_ns)
        .text(",\"fate\":", fate.as_str())
        .end();
}

/// Appends an achieved delay.
pub(super) fn achieved(row: &AchievedRow, json: &mut Vec<u8>) {
    let AchievedRow { t_ns, from, to, seq, commanded_ns, late_ns } = row;
    object(json)
        .integer("{\"t_ns\":", *t_ns)
        .text(",\"from\":", from)
        .text(",\"to\":", to)
        .integer(",\"seq\":", *seq)
        .integer(",\"commanded_ns\":", *commanded_ns)
        .integer(",\"late_ns\":", *late_ns)
        .end();
}

#[cfg(test)]
mod tests {
    use common::record::Fate;
    use proptest::prelude::*;

    use super::*;

    fn written(write: impl Fn(&mut Vec<u8>)) -> String {
        let mut json = Vec::new();
        write(&mut json);
        String::from_utf8(json).expect("text")
    }

    fn name() -> impl Strategy<Value = String> {
        prop_oneof!["[a-z0-9_-]{1,12}", any::<String>()]
    }

    proptest! {
        #[test]
        fn rows_are_written_as_serde_writes_them(
            (from, to) in (name(), name()), t_ns: i64, seq: u64, other_ns: i64, neighbours: u16, fate in 0usize..5,
            v in prop::array::uniform14(prop_oneof![any::<u64>().prop_map(f64::from_bits), -1e3f64..1e3, Just(2.0)]),
        ) {
            prop_assume!(v.iter().all(|value| value.is_finite()));
            let row = StateRow {
                t_ns, vehicle: from.as_str().into(), xi: v[0], xi_rate: v[1], v_ref: v[2], x_m: v[3], y_m: v[4], z_m: v[5],
                yaw_rad: v[6], pitch_rad: v[7], roll_rad: v[8], speed_mps: v[9], e_along_m: v[10], e_cross_m: v[11],
                e_norm_m: v[12], psi_e_rad: v[13], neighbours,
            };
            prop_assert_eq!(written(|json| state(&row, json)), serde_json::to_string(&row).expect("JSON"));
            let (from, to) = (from.as_str().into(), to.as_str().into());
            let fate = Fate::ALL[fate];
            let row = MessageRow { t_ns, from, to, seq, sent_ns: other_ns, due_ns: -t_ns.max(i64::MIN + 1), fate };
            prop_assert_eq!(written(|json| message(&row, json)), serde_json::to_string(&row).expect("JSON"));
            let MessageRow { from, to, .. } = row;
            let row = AchievedRow { t_ns, from, to, seq, commanded_ns: other_ns, late_ns: 7 };
            prop_assert_eq!(written(|json| achieved(&row, json)), serde_json::to_string(&row).expect("JSON"));
        }
    }
}
