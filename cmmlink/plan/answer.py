"""What a plan says of the answer that a machine tool is given: in which file its control finds the verdict, and in which variables."""

from collections import Counter
from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from cmmlink.plan.yaml_model import Settings, Text

ANSWER = "the file from which the control of a machine tool reads the verdict; null: the machine is told nothing"
Variable = Annotated[int, Field(ge=1, le=99_999)]


class AnswerVariables(Settings):
    """The numbers of the macro variables that the answer sets."""

    verdict: Variable = Field(default=150, description="the variable of the verdict: 1 conform, 2 not conform, 3 not proven, 9 not judged")
    worst: Variable = Field(default=151, description="the variable of the worst deviation, in the unit of the lines; 99999: there is none")
    request: Variable = Field(default=152, description="the variable of the number of the request that is answered; 0 while none is")


class Answer(Settings):
    """A file of assignments to macro variables, which the control calls as a program once it waits for the verdict."""

    file: Path = Field(description="the file, in a folder that the control reaches; it is replaced as a whole, and nothing else is")
    program: int = Field(default=9100, ge=1, le=99_999_999, description="the number of the program that the file is, after its O")
    variables: AnswerVariables = Field(default=AnswerVariables(), description="the numbers of the macro variables that the answer sets")
    characteristics: dict[Text, Variable] = Field(
        default_factory=dict,
        description="the variables of the values of characteristics, by their names, like {chord: 160}; a value that there is not is 99999",
    )

    @model_validator(mode="after")
    def _told_apart(self) -> "Answer":
        variables = self.variables
        counted = Counter([variables.verdict, variables.worst, variables.request, *self.characteristics.values()])
        if twice := [number for number, count in counted.items() if count > 1]:
            raise ValueError(f"a variable of its own for each value; #{twice[0]} stands twice")
        return self
