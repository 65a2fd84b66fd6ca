"""Measurements: every number that the documentation quotes comes from here."""

from panoscene.eval._arrange_benchmark import benchmark_table as benchmark_table
from panoscene.eval._arrange_benchmark import run_arrange_benchmark as run_arrange_benchmark
from panoscene.eval._arrange_experiment import experiment_table as experiment_table
from panoscene.eval._arrange_experiment import run_arrange_experiment as run_arrange_experiment
from panoscene.eval._arrange_safety import broken_promises as broken_promises
from panoscene.eval._arrange_safety import run_arrange_safety as run_arrange_safety
from panoscene.eval._arrange_safety import safety_table as safety_table
from panoscene.eval._machine import machine_facts as machine_facts
