import pytest

from tests.manipulation.cases import CHARTS


@pytest.fixture(params=sorted(CHARTS))
def chart_case(request):
    """(chart, range of u, range of v)."""
    return CHARTS[request.param]
