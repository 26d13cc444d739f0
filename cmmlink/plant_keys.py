"""The keys of what is said of the results database of a plant: what waits to be pushed, and whether it agrees with the records."""

from pydantic import Field

from cmmlink.inspection_keys import JsonObject


class RunUnreadable(JsonObject):
    """A run that is not in the database because its record cannot be read."""

    run: str = Field(description="the run")
    problem: str = Field(description="why it cannot be read")


class PlantAlarm(JsonObject):
    """A run that breaks a rule of Western Electric in the trend of a characteristic."""

    run: str = Field(description="its id")
    part: str = Field(description="the name of the part")
    serial_number: str = Field(description="the serial number of the part")
    characteristic: str = Field(description="the name of the characteristic")
    rule: str = Field(description="the rule in words, and which way it is broken")


class PlantOutbox(JsonObject):
    """The answer of `plant push` and `plant status`; with `plant push --stay` there is one a line, whenever something is new."""

    address: str = Field(description="where the results go, without options and without a password")
    added: int = Field(description="the runs that were added to the database, and stacks of sections, each of which is one more")
    waiting: int = Field(description="the runs that wait to be pushed")
    since: str | None = Field(description="since when the oldest waits, at most since the first attempt; null where nothing does")
    late: bool = Field(description="whether it has waited for more than a day, at which the console raises an alarm")
    problem: str | None = Field(description="why they wait; null where the last attempt did not fail")
    away: bool = Field(description="whether the database could not be reached, so that a later attempt may succeed by itself")
    pushed: str | None = Field(description="when runs were pushed last, in UTC; null: never")
    unreadable: list[RunUnreadable] = Field(description="the runs that cannot be pushed")
    others: list[str] = Field(
        description="station and id of runs in whose place the database holds others: as where two stations have the same name"
    )
    alarms: list[PlantAlarm] = Field(description="what the runs that were pushed now have changed in the trends of their parts")


class PlantAddress(JsonObject):
    """The answer of `plant address`."""

    address: str = Field(description="where the results go, without options and without a password")


class PlantRow(JsonObject):
    """A row of the database that is not as the records have it."""

    station: str = Field(description="the name of the station")
    run: str = Field(description="the run")
    what: str = Field(description="what is wrong with it, in words")


class PlantAgreement(JsonObject):
    """The answer of `plant verify`."""

    address: str = Field(description="the database")
    sound: bool = Field(description="whether it holds what the records hold")
    runs: int = Field(description="the runs of the records that have ended, and the stacks of sections that have characteristics")
    agree: int = Field(description="how many of them are in the database as the records have them")
    missing: list[PlantRow] = Field(description="runs, and judgements that were made later, that are not in the database")
    altered: list[PlantRow] = Field(description="rows that are not as the records have them")
    extra: list[PlantRow] = Field(description="runs of this station in the database that the records have not got")
    record: str | None = Field(description="what is wrong with the records themselves; null where their chain is whole")
