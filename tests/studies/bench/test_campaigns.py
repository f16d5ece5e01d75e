"""What campaigns cost: the measurement itself, on a few runs."""

import pytest

from biped.show.studies import campaigns_document
from biped.show.terminal import show
from biped.studies.bench import costs


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
def test_a_campaign_here_and_on_a_cluster_is_the_same(monkeypatch, capsys):
    monkeypatch.setattr(costs, "QUICK", ((6, 0.2),))
    told = []
    (cost,) = costs.campaign_costs(True, told.append)
    assert cost.same
    assert min(cost.here, cost.cluster, cost.work, cost.parent) > 0.0
    assert any("local:" in words for words in told)
    show(campaigns_document([cost, cost._replace(same=False)]))
    printed = capsys.readouterr().out
    assert "the same bytes" in printed
    assert "DIFFERENT" in printed
