//! Three numbers at a time.

/// East, north and up.
pub(super) type Vector = [f64; 3];

pub(super) fn plus(a: Vector, b: Vector, times: f64) -> Vector {
    [0, 1, 2].map(|i| a[i] + b[i] * times)
}

pub(super) fn minus(a: Vector, b: Vector) -> Vector {
    plus(a, b, -1.0)
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

pub(super) fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// Returns the vector scaled to length 1.
pub(super) fn unit(a: Vector) -> Vector {
    a.map(|x| x / length(a))
}

/// Returns the angle between two vectors, degrees.
pub(super) fn degrees(a: Vector, b: Vector) -> f64 {
    length(cross(a, b)).atan2(dot(a, b)).to_degrees()
}

/// Returns the upward normal of these slopes, of length 1.
pub(super) fn normal([east, north]: [f64; 2]) -> Vector {
    unit([-east, -north, 1.0])
}
