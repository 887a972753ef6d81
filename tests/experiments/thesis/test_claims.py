import pytest

from experiments.thesis import wording
from experiments.thesis.claims import (
    Claim,
    ClaimVerdict,
    Share,
    decline,
    numbers,
    printed,
    shown,
)


def claim(**changes):
    given = {
        "id": "one",
        "place": "5.1",
        "words": "it is so",
        "published": {"a": 1},
        "measured": {"a": 2},
        "reason": "because",
        **changes,
    }
    return Claim(**given)


def share(holds, of):
    return Share.count([True] * holds + [False] * (of - holds), "layouts")


@pytest.mark.parametrize(
    ("picked", "counted", "verdict"),
    [
        (True, None, ClaimVerdict.HOLDS),
        (False, None, ClaimVerdict.FAILS),
        (None, None, ClaimVerdict.UNKNOWN),
        (True, share(3, 10), ClaimVerdict.PARTLY),
        (True, share(1, 10), ClaimVerdict.MOSTLY_FAILS),
        (True, share(11, 100), ClaimVerdict.PARTLY),
        (False, share(10, 10), ClaimVerdict.HOLDS),
        (True, share(0, 10), ClaimVerdict.FAILS),
    ],
)
def test_random_layouts_decide_where_there_are_some(picked, counted, verdict):
    assert claim(picked=picked, share=counted).verdict is verdict


def test_a_claim_that_fails_needs_a_reason():
    with pytest.raises(ValueError, match="no reason"):
        claim(picked=False, reason="")
    assert claim(picked=True, reason="").verdict is ClaimVerdict.HOLDS


def test_a_share_has_wilsons_interval():
    # Newcombe (1998), table I: 81 of 263 gives 0.2553 to 0.3662
    found = share(81, 263)
    assert (found.percent, found.low, found.high) == (30.8, 25.5, 36.6)
    assert Share.count([], "layouts") is None


@pytest.mark.parametrize(
    ("value", "expected"),
    [(123456.7, 123457), (0.00123456, 0.001235), (2.0, 2), (3, 3), (-0.12345, -0.1235)],
)
def test_numbers_are_shown_with_four_digits(value, expected):
    assert shown(value) == expected
    assert isinstance(shown(value), type(expected))


def test_rounding_is_nothing_and_published_numbers_stay_as_printed():
    assert shown(3.5e-26) == 0
    assert printed(time_ms=238.27, n=4.0) == {"time ms": 238.27, "n": 4}
    assert numbers(time_ms=238.27) == {"time ms": 238.3}
    assert decline(65.75, 62.27) == pytest.approx(5.29, abs=0.005)


def plain(made):
    counted = made.share
    return {
        "verdict": str(made.verdict),
        "picked": made.picked,
        "on": made.on,
        "reason": made.reason,
        "share": counted and {k: getattr(counted, k) for k in Share.__slots__},
    }


def test_verdicts_in_words():
    partly = plain(claim(picked=True, share=share(3, 10)))
    assert wording.verdict(partly) == (
        "holds in 30.0 % of 10 layouts (10.8 to 60.3 %); picked layout: yes"
    )
    assert wording.reason(partly) == "because"
    never = plain(claim(picked=False, share=share(0, 10)))
    assert wording.verdict(never).startswith("does not hold in any of 10 layouts")
    always = plain(claim(share=share(10, 10)))
    assert wording.verdict(always) == "holds in all 10 layouts (72.2 to 100.0 %)"
    assert wording.reason(always) == ""
