"""What training and evaluation here do otherwise than the paper, for the page that compares the results."""

DIFFERENCES = {
    "A teacher": (
        "A [scripted gait](../../src/tactile_cube/hand/gait.py) acts in 30 % of the training episodes and is "
        "imitated where the critics hold it for better. By itself it turns the cube, too, and drops it sooner or "
        "later: the row of the hand-crafted trajectory. Its shape was found by a search (`python -m "
        "tactile_cube.search_gait` searches again), whose CPU hours belong to the cost of training. Those of the "
        "search behind the gait that taught the policies of this page were not recorded; the gait of today's recipe "
        "says [what its search cost](gait.yaml), and the cards of policies that it teaches count it. The paper's runs "
        "find out by themselves; so do runs here [without the teacher](alone/README.md), by other rewards and starts "
        "than the paper's."
    ),
    "Reward": (
        "`reward=air`: a fifth of the published weights for moving the cube, a tenth for tilting it, a sixth for "
        "twisted fingers, and a penalty for dragging the cube aside ([air.yaml](../../conf/reward/air.yaml))."
    ),
    "Starts": (
        "In training the cube is turned by up to 43 degrees and the fingers are placed accordingly. The paper's runs "
        "begin straight, and so does `protocol=paper`; the row of the worlds of its training has the other starts."
    ),
    "Learning": (
        "Discount 0.95 (0.9, when fine-tuning 0.92), three-step returns (one-step), learning rate 1e-3 (not "
        "published), a curriculum on T_s alone that follows the policy (on T_s and gravity, by the number of "
        "steps). Runs were ended by hand when the angle no longer rose."
    ),
    "World": (
        "The target's rate is not limited (it is; the limit is not published). The middle link is a capsule of 13 "
        "mm radius instead of 15, with which an upright finger would touch the cube with it before the tip. "
        "Spinning friction is 0.1 m throughout where the paper has 0.1 m and then 0.03 m when fine-tuning; that "
        "holds for the policies whose cards say so, in [policies](../../src/tactile_cube/policies), for such a "
        "friction lies far beyond what a fingertip bears."
    ),
}
"""Source: paper, section III, and the authors' website, beside conf/experiment/curriculum.yaml and finetune.yaml."""


def differences() -> str:
    """Return them as a list in Markdown."""
    return "\n".join(f"- **{what}.** {text}" for what, text in DIFFERENCES.items())
