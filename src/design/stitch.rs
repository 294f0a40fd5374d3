//! The stitches that knitters write, and which stitch of the template library each one is.

/// A stitch as it is worked, seen by the knitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stitch {
    /// `k`
    Knit,
    /// `p`
    Purl,
    /// `ktbl`: knit through the back loop.
    KnitTwisted,
    /// `ptbl`
    PurlTwisted,
    /// `k2tog`: leans right.
    KnitTogether,
    /// `ssk`, `skp`: leans left.
    SlipSlipKnit,
    /// `p2tog`
    PurlTogether,
    /// `ssp`
    SlipSlipPurl,
    /// `k3tog`
    KnitThreeTogether,
    /// `sk2p`, `sssk`: leans left.
    SlipKnitTwoPass,
    /// `p3tog`
    PurlThreeTogether,
    /// `sssp`: the twin of `sk2p` for wrong-side rows.
    SlipPurlTwoPass,
    /// `yo`
    YarnOver,
    /// `m1l`, `m1`: a twisted loop.
    MakeLeft,
    /// `m1r`: a twisted loop.
    MakeRight,
    /// `kfb`: two out of one.
    KnitFrontBack,
    /// `pfb`
    PurlFrontBack,
    /// `tuck`: the loop stays, and the yarn with it.
    Tuck,
    /// `sl`: the loop stays, the yarn passes behind it (as the knitter sees it).
    Slip,
    /// `slf`: the same, the yarn in front.
    SlipFront,
}

/// Where a stitch that makes a loop out of the bare yarn sits, seen from the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// Left of the stitch that it shares a face with.
    Left,
    /// Right of it.
    Right,
}

impl Stitch {
    /// The stitch of a name in lower case.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "k" | "knit" => Stitch::Knit,
            "p" | "purl" => Stitch::Purl,
            "ktbl" | "k1tbl" => Stitch::KnitTwisted,
            "ptbl" | "p1tbl" => Stitch::PurlTwisted,
            "k2tog" => Stitch::KnitTogether,
            "ssk" | "skp" | "skpo" => Stitch::SlipSlipKnit,
            "p2tog" => Stitch::PurlTogether,
            "ssp" => Stitch::SlipSlipPurl,
            "k3tog" => Stitch::KnitThreeTogether,
            "sk2p" | "sssk" => Stitch::SlipKnitTwoPass,
            "p3tog" => Stitch::PurlThreeTogether,
            "sssp" => Stitch::SlipPurlTwoPass,
            "yo" | "yrn" | "yfwd" => Stitch::YarnOver,
            "m1l" | "m1" => Stitch::MakeLeft,
            "m1r" => Stitch::MakeRight,
            "kfb" => Stitch::KnitFrontBack,
            "pfb" => Stitch::PurlFrontBack,
            "tuck" => Stitch::Tuck,
            "sl" | "slip" => Stitch::Slip,
            "slf" => Stitch::SlipFront,
            _ => return None,
        })
    }

    /// Names of all stitches, for messages.
    pub const NAMES: &'static str = "k, p, ktbl, ptbl, k2tog, ssk, p2tog, ssp, k3tog, sk2p, p3tog, sssp, yo, m1l, m1r, kfb, pfb, tuck, sl or slf";

    /// Loops from below that it takes.
    pub fn takes(self) -> usize {
        match self {
            Stitch::YarnOver | Stitch::MakeLeft | Stitch::MakeRight => 0,
            Stitch::KnitTogether | Stitch::SlipSlipKnit | Stitch::PurlTogether | Stitch::SlipSlipPurl => 2,
            Stitch::KnitThreeTogether
            | Stitch::SlipKnitTwoPass
            | Stitch::PurlThreeTogether
            | Stitch::SlipPurlTwoPass => 3,
            _ => 1,
        }
    }

    /// Loops that it leaves.
    pub fn leaves(self) -> usize {
        match self {
            Stitch::KnitFrontBack | Stitch::PurlFrontBack => 2,
            _ => 1,
        }
    }

    /// Whether the new loop comes out of the fabric's front, where that side faces the knitter.
    fn is_knit(self) -> bool {
        !matches!(
            self,
            Stitch::Purl
                | Stitch::PurlTwisted
                | Stitch::PurlTogether
                | Stitch::SlipSlipPurl
                | Stitch::PurlThreeTogether
                | Stitch::SlipPurlTwoPass
                | Stitch::PurlFrontBack
        )
    }

    /// What the fabric's front shows: a knit (else a purl).
    pub fn shows_knit(self, right_side: bool) -> bool {
        self.is_knit() == right_side
    }

    /// The name of its template without the sign of the yarn's direction, seen from the front.
    ///
    /// A stitch worked on the wrong side is its own mirror image from behind: `k2tog` leans right for the
    /// knitter, so a `p2tog` leans right on the other side of the fabric.
    pub fn template(self, right_side: bool) -> &'static str {
        let knit = self.shows_knit(right_side);
        match self {
            Stitch::Knit | Stitch::Purl => pick(knit, "knit", "purl"),
            Stitch::KnitTwisted | Stitch::PurlTwisted => pick(knit, "knit-twisted", "purl-twisted"),
            Stitch::KnitTogether | Stitch::PurlTogether => pick(knit, "decrease-right", "purl-decrease-left"),
            Stitch::SlipSlipKnit | Stitch::SlipSlipPurl => pick(knit, "decrease-left", "purl-decrease-right"),
            Stitch::KnitThreeTogether | Stitch::PurlThreeTogether => {
                pick(knit, "decrease-double-right", "purl-decrease-double-left")
            }
            Stitch::SlipKnitTwoPass | Stitch::SlipPurlTwoPass => {
                pick(knit, "decrease-double-left", "purl-decrease-double-right")
            }
            Stitch::YarnOver => "yarn-over",
            Stitch::MakeLeft | Stitch::MakeRight => "yarn-over-twist",
            Stitch::KnitFrontBack | Stitch::PurlFrontBack => {
                // The second loop comes after the first in the order of work.
                match (knit, right_side) {
                    (true, true) => "make-left-split",
                    (true, false) => "make-right-split",
                    (false, true) => "purl-make-left-split",
                    (false, false) => "purl-make-right-split",
                }
            }
            Stitch::Tuck => pick(right_side, "tuck", "tuck-front"),
            Stitch::Slip => pick(right_side, "slip", "slip-front"),
            Stitch::SlipFront => pick(right_side, "slip-front", "slip"),
        }
    }

    /// A plain stitch and a loop of the bare yarn beside it are one face.
    pub fn merged(self, plain: Stitch, right_side: bool, side: Side) -> &'static str {
        let twisted = self != Stitch::YarnOver;
        match (plain.shows_knit(right_side), twisted, side) {
            (true, false, Side::Left) => "make-left-tuck",
            (true, false, Side::Right) => "make-right-tuck",
            (true, true, Side::Left) => "make-left-tuck-twist",
            (true, true, Side::Right) => "make-right-tuck-twist",
            (false, false, Side::Left) => "purl-make-left-tuck",
            (false, false, Side::Right) => "purl-make-right-tuck",
            (false, true, Side::Left) => "purl-make-left-tuck-twist",
            (false, true, Side::Right) => "purl-make-right-tuck-twist",
        }
    }
}

fn pick(first: bool, a: &'static str, b: &'static str) -> &'static str {
    if first { a } else { b }
}

impl Stitch {
    /// What to work on the wrong side so that the front shows what this one shows, worked on the right side.
    pub fn from_behind(self) -> Self {
        match self {
            Stitch::Knit => Stitch::Purl,
            Stitch::Purl => Stitch::Knit,
            Stitch::KnitTwisted => Stitch::PurlTwisted,
            Stitch::PurlTwisted => Stitch::KnitTwisted,
            Stitch::KnitTogether => Stitch::PurlTogether,
            Stitch::SlipSlipKnit => Stitch::SlipSlipPurl,
            Stitch::PurlTogether => Stitch::KnitTogether,
            Stitch::SlipSlipPurl => Stitch::SlipSlipKnit,
            Stitch::KnitThreeTogether => Stitch::PurlThreeTogether,
            Stitch::PurlThreeTogether => Stitch::KnitThreeTogether,
            Stitch::KnitFrontBack => Stitch::PurlFrontBack,
            Stitch::PurlFrontBack => Stitch::KnitFrontBack,
            Stitch::Slip => Stitch::SlipFront,
            Stitch::SlipFront => Stitch::Slip,
            Stitch::SlipKnitTwoPass => Stitch::SlipPurlTwoPass,
            Stitch::SlipPurlTwoPass => Stitch::SlipKnitTwoPass,
            Stitch::YarnOver | Stitch::MakeLeft | Stitch::MakeRight | Stitch::Tuck => self,
        }
    }
}
