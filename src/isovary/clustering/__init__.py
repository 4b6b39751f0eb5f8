"""Room: rows (n, T), count -> Clusters (thesis 4.1.6, 4.2.7)."""

from ._agglomerative import Dendrogram, agglomerative, dendrogram
from ._choose_count import CountChoice, choose_count, silhouette
from ._deterministic_annealing import Annealing, annealing, deterministic_annealing
from ._fuzzy_c_means import fuzzy_c_means
from ._k_medians import k_medians
from ._k_medoids import k_medoids
from ._norm_bins import norm_bins
from ._rand_index import adjusted_rand_index

__all__ = [
    "Annealing",
    "CountChoice",
    "Dendrogram",
    "adjusted_rand_index",
    "agglomerative",
    "annealing",
    "choose_count",
    "dendrogram",
    "deterministic_annealing",
    "fuzzy_c_means",
    "k_medians",
    "k_medoids",
    "norm_bins",
    "silhouette",
]
