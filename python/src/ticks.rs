//! The ticks of a path by its times: the rule of `hapterra replay` (docs/recordings.md, Time).

/// A row that is as near to a tick is at it, ticks.
const ON_TICK: f64 = 0.01;
/// Times that no path of a hand has, s: a straight line, and a rest.
const LONGEST_MOVE_S: f64 = 2.0;
const LONGEST_REST_S: f64 = 600.0;
/// A straight line that is odd, s.
const ODD_MOVE_S: f64 = 0.05;

/// Time, s, and HIP, mm.
pub(crate) type Tick = (f64, [f64; 3]);

/// Times that cannot be right.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(crate) enum TimeError {
    #[error("t[{0}] is not a finite number: give seconds")]
    NotFinite(usize),
    #[error("t[{row}]: time goes back from {from} s to {to} s")]
    Backwards { row: usize, from: f64, to: f64 },
    #[error("t[{row}]: two places at {t_s} s: the HIP cannot be at both")]
    TwoPlaces { row: usize, t_s: f64 },
    #[error(
        "t[{row}]: the HIP moves during a gap of {step} s, more than {LONGEST_MOVE_S}: give seconds, or split the path there"
    )]
    Gap { row: usize, step: f64 },
    #[error(
        "t[{row}]: a rest of {step} s, more than {LONGEST_REST_S}: give seconds, or split the path there"
    )]
    Rest { row: usize, step: f64 },
    #[error("numbers near {0} s are too far apart to tell ticks by them: begin t at 0")]
    TooLarge(f64),
}

/// Ticks of a path, and what is odd about its times.
#[derive(Debug, Default)]
pub(crate) struct Ticks {
    pub(crate) ticks: Vec<Tick>,
    pub(crate) remarks: Vec<String>,
}

/// A tick for each place.
pub(crate) fn by_row(path: &[[f64; 3]], begin_s: f64, hz: f64) -> Ticks {
    let ticks = (0_u32..).zip(path);
    let ticks = ticks.map(|(n, hip)| (begin_s + f64::from(n) / hz, *hip));
    Ticks {
        ticks: ticks.collect(),
        remarks: Vec::new(),
    }
}

/// The ticks at a rate from the first time to the last, on straight lines between the rows. Where
/// all rows have one time, each is a tick.
pub(crate) fn by_time(t_s: &[f64], path: &[[f64; 3]], hz: f64) -> Result<Ticks, TimeError> {
    if let Some(row) = t_s.iter().position(|t| !t.is_finite()) {
        return Err(TimeError::NotFinite(row));
    }
    let Some(&begin_s) = t_s.first() else {
        return Ok(Ticks::default());
    };
    if t_s.len() > 1 && t_s.iter().all(|t| *t == begin_s) {
        return Ok(by_row(path, begin_s, hz));
    }
    if begin_s.abs() * f64::EPSILON * hz > ON_TICK {
        return Err(TimeError::TooLarge(begin_s));
    }
    let (rows, mut remarks) = rows(t_s, path)?;
    let mut ticks = vec![rows[0]];
    // Rows up to `before` are not later than the latest tick; those of them no tick was at or next to.
    let (mut is_used, mut passed_over) = (true, 0_u64);
    for pair in rows.windows(2) {
        let (before, ahead) = (pair[0], pair[1]);
        let mut next_is_used = false;
        loop {
            let due_s = begin_s + ticks.len() as f64 / hz;
            let late = (ahead.0 - due_s) * hz;
            if late > ON_TICK {
                let share = (due_s - before.0) / (ahead.0 - before.0);
                let between = |i: usize| before.1[i] + (ahead.1[i] - before.1[i]) * share;
                ticks.push((due_s, std::array::from_fn(between)));
                (is_used, next_is_used) = (true, true);
                continue;
            }
            if late >= -ON_TICK {
                ticks.push(ahead);
                next_is_used = true;
            }
            break;
        }
        passed_over += u64::from(!is_used);
        is_used = next_is_used;
    }
    passed_over += u64::from(!is_used);
    if passed_over > 0 {
        let all = t_s.len();
        remarks.push(format!(
            "{passed_over} of {all} rows lie between two ticks and are not sampled"
        ));
    }
    Ok(Ticks { ticks, remarks })
}

/// The rows without repetitions, once their times can be right.
fn rows(t_s: &[f64], path: &[[f64; 3]]) -> Result<(Vec<Tick>, Vec<String>), TimeError> {
    let mut rows: Vec<Tick> = Vec::with_capacity(t_s.len());
    let (mut repeated, mut odd) = (0_u64, 0_u64);
    for (row, (to, hip)) in t_s.iter().copied().zip(path).enumerate() {
        if let Some((from, last)) = rows.last() {
            let (step, is_still) = (to - from, last == hip);
            if step == 0.0 && is_still {
                repeated += 1;
                continue;
            }
            let (from, t_s) = (*from, to);
            match step {
                _ if step < 0.0 => return Err(TimeError::Backwards { row, from, to }),
                _ if step == 0.0 => return Err(TimeError::TwoPlaces { row, t_s }),
                _ if step > LONGEST_REST_S => return Err(TimeError::Rest { row, step }),
                _ if step > LONGEST_MOVE_S && !is_still => {
                    return Err(TimeError::Gap { row, step });
                }
                _ => odd += u64::from(step > ODD_MOVE_S && !is_still),
            }
        }
        rows.push((to, *hip));
    }
    let remarks = [
        (
            odd,
            format!(
                "{odd} times the HIP moves for more than {ODD_MOVE_S} s between two rows, on straight lines: t is in seconds"
            ),
        ),
        (
            repeated,
            format!("{repeated} rows repeat time and place of the row before, and are left out"),
        ),
    ];
    let remarks = remarks.into_iter().filter(|(count, _)| *count > 0);
    Ok((rows, remarks.map(|(_, remark)| remark).collect()))
}
