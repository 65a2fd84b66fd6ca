"""Pictures of scenes from above, and the demonstration that leaves some."""

from panoscene.views._birds_eye import describe_room as describe_room
from panoscene.views._birds_eye import draw_birds_eye as draw_birds_eye
from panoscene.views._birds_eye import draw_comparison as draw_comparison
from panoscene.views._demo import DEMO_NOISE as DEMO_NOISE
from panoscene.views._demo import DemoResult as DemoResult
from panoscene.views._demo import describe_violations as describe_violations
from panoscene.views._demo import run_demo as run_demo
