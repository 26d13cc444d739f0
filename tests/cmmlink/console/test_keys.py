"""A code opens once and within its time; the token is never in an address."""

from threading import Thread

from cmmlink.console.keys import VALID_S, Keys


class Clock:
    """A clock that the test sets."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_a_code_opens_once() -> None:
    keys = Keys(Clock())
    code = keys.new_code()
    assert keys.redeem(code) == "opened"
    assert keys.redeem(code) == "used"
    assert keys.token not in code


def test_a_code_opens_within_a_minute() -> None:
    clock = Clock()
    keys = Keys(clock)
    early, late = keys.new_code(), keys.new_code()
    clock.now_s += VALID_S - 0.001
    assert keys.redeem(early) == "opened"
    clock.now_s += 0.001
    assert keys.redeem(late) == "unknown"


def test_of_many_at_the_same_moment_one_comes_in() -> None:
    keys = Keys(Clock())
    for _ in range(20):
        code = keys.new_code()
        found: list[str] = []
        threads = [Thread(target=lambda code=code, found=found: found.append(keys.redeem(code))) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(found) == ["opened"] + ["used"] * 7


def test_codes_that_nobody_uses_do_not_pile_up() -> None:
    keys = Keys(Clock())
    codes = [keys.new_code() for _ in range(1000)]
    assert len(set(codes)) == 1000
    assert [keys.redeem(code) for code in codes].count("opened") == 32
    assert keys.redeem(codes[-1]) == "used"


def test_a_new_token_shuts_everybody_out() -> None:
    keys = Keys(Clock())
    old, code = keys.token, keys.new_code()
    keys.renew()
    assert not keys.knows(old)
    assert keys.knows(keys.token)
    assert keys.redeem(code) == "unknown"


def test_only_the_token_is_the_token() -> None:
    keys = Keys(Clock(), "secret")
    assert keys.knows("secret")
    assert [given for given in (None, 7, "", "secre", "secret ", "\ud800", ["secret"]) if keys.knows(given)] == []
    assert [given for given in (None, 7, "", "secret", ["x"], {"x": 1}) if keys.redeem(given) != "unknown"] == []
