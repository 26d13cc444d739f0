"""A nominal as STEP AP214: one B-spline curve in a wireframe representation of a part."""

from itertools import groupby

from cmmlink.reference.case import CaseUnit, ReferenceNominal
from cmmlink.reference.real_numbers import real

_HEAD = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('cmmlink reference set, dedicated to the public domain (CC0 1.0)'),'2;1');
FILE_NAME('{name}','2026-11-27T00:00:00',(''),(''),'','cmmlink','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));
ENDSEC;
DATA;
#1=APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#2);
#2=APPLICATION_CONTEXT('core data for automotive mechanical design processes');
#3=SHAPE_DEFINITION_REPRESENTATION(#4,#10);
#4=PRODUCT_DEFINITION_SHAPE('','',#5);
#5=PRODUCT_DEFINITION('design','',#6,#9);
#6=PRODUCT_DEFINITION_FORMATION('','',#7);
#7=PRODUCT('{name}','{name}','',(#8));
#8=PRODUCT_CONTEXT('',#2,'mechanical');
#9=PRODUCT_DEFINITION_CONTEXT('part definition',#2,'design');
#10=GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION('',(#11,#15),#20);
#11=AXIS2_PLACEMENT_3D('',#12,#13,#14);
#12=CARTESIAN_POINT('',(0.,0.,0.));
#13=DIRECTION('',(0.,0.,1.));
#14=DIRECTION('',(1.,0.,0.));
#15=GEOMETRIC_CURVE_SET('',(#40));
#16=PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#7));
#20=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#26))GLOBAL_UNIT_ASSIGNED_CONTEXT(({unit},#24,#25))\
REPRESENTATION_CONTEXT('',''));
#21=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#24=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#25=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#26=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.00000001),{unit},'distance_accuracy_value','');
"""
_INCH = """#27=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#21);
#28=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
#29=(CONVERSION_BASED_UNIT('INCH',#27)LENGTH_UNIT()NAMED_UNIT(#28));
"""
_FIRST_POINT = 41


def step_text(nominal: ReferenceNominal, unit: CaseUnit, name: str) -> str:
    """The text of the file."""
    head = _HEAD.format(name=name, unit="#29" if unit == "inch" else "#21") + (_INCH if unit == "inch" else "")
    points = [
        f"#{_FIRST_POINT + i}=CARTESIAN_POINT('',({real(x)},{real(y)},0.));\n" for i, (x, y) in enumerate(nominal.control_points.tolist())
    ]
    return f"{head}{_curve(nominal)}{''.join(points)}ENDSEC;\nEND-ISO-10303-21;\n"


def _curve(nominal: ReferenceNominal) -> str:
    """The curve; a rational one is an instance of several entities, in the order of their names."""
    poles = ",".join(f"#{_FIRST_POINT + i}" for i in range(len(nominal.control_points)))
    closed = ".T." if nominal.closed else ".F."
    knots = [(float(knot), len(list(same))) for knot, same in groupby(nominal.knots)]
    times, values = ",".join(str(count) for _, count in knots), ",".join(real(knot) for knot, _ in knots)
    shape, spans = f"{nominal.degree},({poles}),.UNSPECIFIED.,{closed},.F.", f"({times}),({values}),.UNSPECIFIED."
    if nominal.weights is None:
        return f"#40=B_SPLINE_CURVE_WITH_KNOTS('',{shape},{spans});\n"
    weights = ",".join(map(real, nominal.weights))
    return (
        f"#40=(BOUNDED_CURVE()B_SPLINE_CURVE({shape})B_SPLINE_CURVE_WITH_KNOTS({spans})CURVE()GEOMETRIC_REPRESENTATION_ITEM()"
        f"RATIONAL_B_SPLINE_CURVE(({weights}))REPRESENTATION_ITEM(''));\n"
    )
