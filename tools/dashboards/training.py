"""Training: is it learning, how fast, and what would be lost if it ended now."""

from grafana_foundation_sdk.models import units

from tools.dashboards.board import Board, Section
from tools.dashboards.metrics import RUN, RUN_CHOICES, grown, of_run, quantile, rate, total
from tools.dashboards.panels import Look, Panel, Query

_BY_RUN = "namespace, training_job, replica"


def board() -> Board:
    """Return the dashboard."""
    return Board(
        name="training",
        says="Whether the chosen runs learn, how fast, and what would be lost if they ended now.",
        since="now-1h",
        variables=RUN_CHOICES,
        sections=(
            Section("Is it learning?", (_success(), _returns(), _spread(), _lengths(), _evaluated())),
            Section("Why does it learn, or not?", (_exploration(), _loss(), _learning_rate())),
            Section("How fast is it?", (_progress(), _speed(), _time(), _idle(), _lost())),
            Section("What if it ended now?", (_behind(), _age(), _saving(), _size(), _unwritten())),
        ),
    )


def _success() -> Panel:
    return Panel(
        question="How often does it reach its goal?",
        says=(
            "Evaluation: the policy without exploration, on separate seeds, between the bounds of the "
            "95 % interval; at the end of the run, its confirmation. Training: the last 100 episodes, with "
            "exploration. If both are still zero after a tenth of the steps, read the returns; if "
            "these do not rise either, the reward gives the policy nothing to learn from."
        ),
        unit=units.PercentUnit,
        least=0,
        most=1,
        queries=(
            Query(of_run("palaestra_trainer_evaluation_success_ratio"), f"{RUN} evaluation"),
            Query(of_run("palaestra_trainer_evaluation_success_bound_ratio"), f"{RUN} {{{{bound}}}}"),
            Query(of_run("palaestra_trainer_episode_success_ratio"), f"{RUN} training"),
        ),
    )


def _returns() -> Panel:
    return Panel(
        question="What do episodes return?",
        says=(
            "Quantiles of the last 100 training episodes; 0.5 is the median. If all rise, the policy "
            "learns. If the best rise and the worst do not, some starts are never solved: see how the "
            "returns are spread."
        ),
        unit=units.Short,
        queries=(Query(of_run("palaestra_trainer_episode_return_quantile"), f"{RUN} q{{{{rank}}}}"),),
    )


def _spread() -> Panel:
    return Panel(
        question="How are the returns spread?",
        says=(
            "Training episodes of all chosen runs, counted by their return. If two separate bands "
            "stay, the policy solves one kind of start and not the other."
        ),
        unit=units.Short,
        look=Look.SPREAD,
        queries=(Query(total("le", grown(of_run("palaestra_trainer_episode_return_bucket"))), "{{le}}"),),
    )


def _lengths() -> Panel:
    steps = "palaestra_trainer_episode_length_steps_bucket"
    return Panel(
        question="How long are episodes?",
        says=(
            "Steps of the training episodes. They get shorter when the goal is reached earlier. If "
            "all episodes have as many steps as the environment allows, the goal is never reached."
        ),
        unit=units.Short,
        least=0,
        queries=(
            Query(quantile(0.5, _BY_RUN, of_run(steps)), f"{RUN} median"),
            Query(quantile(0.9, _BY_RUN, of_run(steps)), f"{RUN} q0.9"),
        ),
    )


def _evaluated() -> Panel:
    return Panel(
        question="What do evaluations return?",
        says=(
            "Mean return of the last evaluation; model.zip has the policy of the best evaluation so far. "
            "If it falls while the return of training rises, the policy relies on exploration, or forgets: "
            "lower the learning rate."
        ),
        unit=units.Short,
        width=16,
        queries=(Query(of_run("palaestra_trainer_evaluation_return_mean"), RUN),),
    )


def _exploration() -> Panel:
    return Panel(
        question="Does it still explore?",
        says=(
            "Share of random actions (exploration_rate), entropy coefficient or standard deviation of "
            "the actions, by algorithm. If it is at its minimum without any success, raise "
            "exploration_fraction or ent_coef."
        ),
        unit=units.Short,
        least=0,
        queries=(Query(of_run("palaestra_trainer_exploration"), f"{RUN} {{{{measure}}}}"),),
    )


def _loss() -> Panel:
    return Panel(
        question="Does the loss stay within bounds?",
        says=(
            "Losses of the last update. A loss need not fall, but a loss that grows by orders of "
            "magnitude ends as Diverged: lower the learning rate, or scale the reward."
        ),
        unit=units.Short,
        queries=(Query(of_run("palaestra_trainer_loss"), f"{RUN} {{{{loss}}}}"),),
    )


def _learning_rate() -> Panel:
    return Panel(
        question="How large are its updates?",
        says="The learning rate. It falls only if a hyperparameter of the job is a schedule (lin_...).",
        unit=units.ScientificNotation,
        least=0,
        queries=(Query(of_run("palaestra_trainer_learning_rate"), RUN),),
    )


def _progress() -> Panel:
    done, target = of_run("palaestra_trainer_steps_total"), of_run("palaestra_trainer_target_steps")
    return Panel(
        question="How far is it?",
        says=(
            "Valid environment steps as a share of trainer.steps. If the line is flat, see how long ago "
            "the last step was."
        ),
        unit=units.PercentUnit,
        look=Look.FIGURES,
        queries=(Query(f"{done} / {target}", RUN),),
    )


def _speed() -> Panel:
    return Panel(
        question="How many steps does it make in a second?",
        says=(
            "Valid steps over the last 30 s. Regular dips are evaluations and checkpoints. If it "
            "halves and stays there, see the panel 'Where does its time go?', then the dashboard "
            "Simulators."
        ),
        unit=units.OpsPerSecond,
        least=0,
        queries=(Query(of_run("palaestra_trainer_steps_per_second"), RUN),),
    )


def _time() -> Panel:
    spent = rate(of_run("palaestra_trainer_seconds_total"))
    share = f"{total('cause', spent)} / on () group_left sum({spent})"
    return Panel(
        question="Where does its time go?",
        says=(
            "Each second of the trainer has one cause. If it is mostly stepping, the simulators are "
            "the limit: add some. If it is mostly learning, give the trainer more CPU. Recovering is "
            "waiting for restarts after faults: see Simulators. Recycling is waiting for the restarts "
            "of `recycle`. A standby shortens both."
        ),
        unit=units.PercentUnit,
        look=Look.SHARES,
        least=0,
        most=1,
        queries=(Query(share, "{{cause}}"),),
    )


def _idle() -> Panel:
    return Panel(
        question="When was its last step?",
        says=(
            "Seconds since the last step that was learned from or evaluated, next to "
            "stallDeadlineSeconds, at which the trainer exits and is retried. If it rises, see the "
            "simulators' states."
        ),
        unit=units.Seconds,
        width=12,
        least=0,
        queries=(
            Query(of_run("palaestra_trainer_idle_seconds"), f"{RUN} idle"),
            Query(of_run("palaestra_trainer_stall_deadline_seconds"), f"{RUN} deadline"),
        ),
    )


def _lost() -> Panel:
    return Panel(
        question="Which steps were lost?",
        says=(
            "Since the run began: steps of episodes that a fault ended or that were played again after "
            "an interruption, and extra simulation steps to get late messages. If many are lost, see the "
            "faults under Simulators; without faults, save more often (checkpoint.everySteps)."
        ),
        unit=units.Short,
        width=12,
        least=0,
        queries=(
            Query(of_run("palaestra_trainer_steps_lost_total"), f"{RUN} lost"),
            Query(of_run("palaestra_trainer_extra_steps_total"), f"{RUN} extra"),
        ),
    )


def _behind() -> Panel:
    done = of_run("palaestra_trainer_steps_total")
    saved = of_run("palaestra_trainer_checkpoint_steps")
    interval = of_run("palaestra_trainer_checkpoint_interval_steps")
    return Panel(
        question="How many checkpoints is it behind?",
        says=(
            "Steps since the newest checkpoint, divided by checkpoint.everySteps: they are lost if the run "
            "is killed now. If it is above 1 for long, read the trainer's log; the disk may be full. "
            "Above 3 an alert fires."
        ),
        unit=units.Short,
        least=0,
        alarm=3,
        queries=(Query(f"({done} - ({saved} or {done} * 0)) / {interval}", RUN),),
    )


def _age() -> Panel:
    return Panel(
        question="How old is the newest checkpoint?",
        says=(
            "The age of the checkpoint is the time that would be lost. If it is too old, read the panel "
            "'How many checkpoints is it behind?'."
        ),
        unit=units.Seconds,
        least=0,
        queries=(Query(f"time() - {of_run('palaestra_trainer_checkpoint_timestamp_seconds')}", RUN),),
    )


def _saving() -> Panel:
    seconds = of_run("palaestra_trainer_checkpoint_duration_seconds_bucket")
    return Panel(
        question="How long does saving take?",
        says=(
            "The slowest of ten recent checkpoints; training waits meanwhile. If it takes more than a "
            "few seconds, the volume is slow: choose another storage class, or save less often."
        ),
        unit=units.Seconds,
        least=0,
        queries=(Query(quantile(0.9, _BY_RUN, seconds, "10m"), f"{RUN} q0.9"),),
    )


def _size() -> Panel:
    return Panel(
        question="Do checkpoints fit on the volume?",
        says=(
            "Size of the newest checkpoint. As many as checkpoint.keep, and one more, must fit into "
            "storage.size. If not, raise storage.size, keep fewer, or set a smaller buffer_size."
        ),
        unit=units.BytesIEC,
        width=12,
        least=0,
        queries=(Query(of_run("palaestra_trainer_checkpoint_size_bytes"), RUN),),
    )


def _unwritten() -> Panel:
    return Panel(
        question="Was a checkpoint not written?",
        says=(
            "Checkpoints that failed for lack of space, since the run began. The run ends with "
            "StorageFull: free some space, or resize the volume."
        ),
        unit=units.Short,
        width=12,
        least=0,
        alarm=1,
        queries=(Query(of_run("palaestra_trainer_checkpoint_failures_total"), RUN),),
    )
