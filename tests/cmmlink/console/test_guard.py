import socket

import pytest

from cmmlink.console.guard import hosts_served


@pytest.mark.parametrize("host", ["127.0.0.1:8207", "localhost:8207", "LOCALHOST:8207", "[::1]:8207"])
def test_this_machine_is_served_under_its_local_names(host: str) -> None:
    assert hosts_served("127.0.0.1", 8207, remote=False)(host)


@pytest.mark.parametrize("host", ["", "127.0.0.1", "127.0.0.1:80", "evil.example:8207", "127.0.0.1.evil.example:8207", "192.0.2.7:8207"])
def test_a_station_of_this_machine_alone_serves_no_other_name_and_no_address(host: str) -> None:
    assert not hosts_served("127.0.0.1", 8207, remote=False)(host)


def test_a_station_open_to_the_network_serves_addresses_and_its_own_name_but_no_foreign_one() -> None:
    is_ours = hosts_served("0.0.0.0", 8207, remote=True)
    assert is_ours("192.0.2.7:8207")
    assert is_ours("[2001:db8::7]:8207")
    assert is_ours(f"{socket.gethostname()}:8207")
    assert not is_ours("evil.example:8207")
    assert not is_ours("192.0.2.7:1")


def test_port_80_is_left_out_by_browsers() -> None:
    assert hosts_served("127.0.0.1", 80, remote=False)("127.0.0.1")
