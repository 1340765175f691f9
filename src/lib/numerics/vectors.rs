//! Runs a loop as it is compiled for the widest vectors that the processor has.
//!
//! A [`Kernel`] is plain Rust, written so that the compiler vectorizes it. [`run`] compiles it once for every
//! [`Instructions`] and picks one at run time. Results have the same bits on all of them: Rust neither contracts a
//! product and a sum into one rounding nor reorders floating-point sums, so a kernel that calls no function of the
//! platform's mathematics library gives what its plain version gives.

use crate::error::{Error, Result};
use std::sync::OnceLock;

/// The environment variable that keeps programs from using the widest vectors: `baseline`, `avx2` or `avx512`.
pub const VARIABLE: &str = "CYANOMETER_VECTORS";

/// Sets of vector instructions, narrow to wide.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// What every processor of the architecture has: SSE2 on x86-64, NEON on aarch64.
    Baseline,
    /// 256-bit vectors of x86-64.
    Avx2,
    /// 512-bit vectors of x86-64, with those for doublewords, quadwords, bytes and shorter vectors.
    Avx512,
}

impl Instructions {
    /// All sets, narrow to wide.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// The name that [`VARIABLE`] gives it.
    pub fn name(self) -> &'static str {
        ["baseline", "avx2", "avx512"][self as usize]
    }

    /// Whether this processor has them.
    pub fn are_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx2")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The widest that [`VARIABLE`] allows; none where it is not set.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where it names none.
    pub fn allowed() -> Result<Option<Self>> {
        let Some(name) = std::env::var_os(VARIABLE).filter(|name| !name.is_empty()) else { return Ok(None) };
        let named = Self::ALL.into_iter().find(|set| name.to_str() == Some(set.name()));
        let names = Self::ALL.map(Self::name).join(", ");
        let refuse =
            || Error::Usage(format!("{VARIABLE}={} names no instructions; give one of {names}", name.display()));
        named.map(Some).ok_or_else(refuse)
    }

    /// The widest that this processor has and [`VARIABLE`] allows.
    pub fn widest() -> Self {
        static WIDEST: OnceLock<Instructions> = OnceLock::new();
        *WIDEST.get_or_init(|| {
            let allowed = Self::allowed().unwrap_or_default();
            let fits = |set: &Self| set.are_available() && allowed.is_none_or(|allowed| *set <= allowed);
            Self::ALL.into_iter().rev().find(fits).unwrap_or(Self::Baseline)
        })
    }

    /// The widest of them but for 512-bit vectors, for loops that were measured to be slower on those: demosaicking by up
    /// to a third, whatever the method; sums of one variable, whose smallest and largest samples the compiler packs into
    /// one such vector and takes out again.
    pub fn up_to_256_bits() -> Self {
        Self::widest().min(Self::Avx2)
    }
}

/// A loop worth compiling for every set of instructions.
pub trait Kernel {
    /// What it gives back.
    type Output;

    /// Runs it. Must be `#[inline(always)]`, as must be all that it calls, or it stays compiled for the baseline.
    fn run(self) -> Self::Output;
}

/// Runs a kernel on the widest vectors there are.
#[inline]
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    run_on(Instructions::widest(), kernel)
}

/// Runs a kernel on one set of instructions; on the baseline where the processor does not have them.
#[inline]
pub fn run_on<K: Kernel>(instructions: Instructions, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if instructions != Instructions::Baseline && instructions.are_available() {
            return on_x86::run(instructions, kernel);
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = instructions;
    kernel.run()
}

/// Has the processor fetch a value into its caches, where that can be asked for.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    on_x86::prefetch(value);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

#[cfg(target_arch = "x86_64")]
mod on_x86 {
    use super::{Instructions, Kernel};
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

    /// Has the line of the cache fetched that a value begins in.
    #[inline(always)]
    #[expect(unsafe_code, reason = "the instruction takes a pointer")]
    pub(super) fn prefetch<T>(value: &T) {
        // SAFETY: a hint, which changes nothing that a program sees; every x86-64 has it.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) }
    }

    #[target_feature(enable = "avx2")]
    fn avx2<K: Kernel>(kernel: K) -> K::Output {
        kernel.run()
    }

    #[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
    fn avx512<K: Kernel>(kernel: K) -> K::Output {
        kernel.run()
    }

    /// Runs a kernel on instructions that the processor has.
    #[expect(unsafe_code, reason = "a function compiled for more than the baseline can be called in no other way")]
    pub(super) fn run<K: Kernel>(instructions: Instructions, kernel: K) -> K::Output {
        assert!(instructions.are_available());
        match instructions {
            Instructions::Baseline => kernel.run(),
            // SAFETY: the assertion above has found the processor to have these instructions; they are all that the
            // function's attribute asks for, and the function does nothing else that is unsafe.
            Instructions::Avx2 => unsafe { avx2(kernel) },
            // SAFETY: as above.
            Instructions::Avx512 => unsafe { avx512(kernel) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Polynomial<'a> {
        of: &'a [f32],
        to: &'a mut [f32],
    }

    impl Kernel for Polynomial<'_> {
        type Output = ();

        #[inline(always)]
        fn run(self) {
            for (to, x) in self.to.iter_mut().zip(self.of) {
                *to = ((0.3 * x - 1.7) * x + 0.1).sqrt() / (x + 0.7);
            }
        }
    }

    #[test]
    fn every_set_of_instructions_gives_the_same_bits() {
        let of: Vec<f32> = (0..1003).map(|x| x as f32 * 0.37).collect();
        let made = Instructions::ALL.map(|set| {
            let mut to = vec![0.0; of.len()];
            run_on(set, Polynomial { of: &of, to: &mut to });
            to.into_iter().map(f32::to_bits).collect::<Vec<_>>()
        });
        assert!(made.iter().all(|bits| *bits == made[0]));
    }
}
