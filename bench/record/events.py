"""Two who listen to the journal while it is written and watcher, service and database are killed in turn: one that is killed itself and
goes on by the last number that it printed, and one that is left to find its way back. What both have heard is compared with the journal."""
import datetime
import json
import random
import subprocess
import threading
import time

from processes import BIN, Certificates, Plant

PATIENCE_S = 40


class Watcher:
    """`sixpoint events --follow`, started again whenever it ends; what came is what it printed whole."""

    def __init__(self, plant, words):
        self.plant, self.words = plant, words
        self.heard = []  # (sequence, when it was written, when it came, of which blade)
        self.stopping = False
        self.process = None
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        while not self.stopping:
            after = str(self.heard[-1][0] if self.heard else 0)
            self.process = subprocess.Popen([f'{BIN}/sixpoint', 'events', '--follow', '--json', '--after', after, *self.words],
                                            stdout=subprocess.PIPE, stderr=self.plant.log, text=True)
            for line in self.process.stdout:
                came = time.time()
                if not line.endswith('\n'):
                    break  # killed in the middle of it
                entry = json.loads(line)['entry']
                written = datetime.datetime.fromisoformat(entry['recorded_at'].replace('Z', '+00:00')).timestamp()
                self.heard.append((entry['record_sequence'], written, came, entry['blade']))
            self.process.wait()
            time.sleep(0.02)

    def kill(self):
        if self.process is not None and self.process.poll() is None:
            self.process.kill()

    def stop(self):
        self.stopping = True
        self.kill()
        self.thread.join()


class Listened(Plant):
    """A PostgreSQL and sixpoint-plant, each to be killed and started again."""

    def begin(self):
        self.up_database()
        self.certificates = Certificates(f'{self.folder}/certificates')
        self.credentials['plant'] = self.certificates.issue('services/plant', '--host', '127.0.0.1')
        identity = self.certificates.issue('users/mes', '--role', 'mes-reader')
        self.words = ['--server', f'127.0.0.1:{self.plant_port}', '--identity', identity]
        self.plant = self.service('plant', self.plant_port)
        self.writers = subprocess.Popen([f'{BIN}/sixpoint-bench-record', '--database', self.conninfo, 'write'],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self.writers.stdout.readline() != 'ready\n':
            raise SystemExit('the writers do not begin')

    def kill_plant(self):
        self.plant.kill()
        self.plant.wait()
        self.plant = self.service('plant', self.plant_port)

    def kill_database(self):
        self.kill_postgres()
        self.start_postgres()

    def journal(self):
        return [int(line) for line in self.sql('SELECT record_sequence FROM record_names ORDER BY 1').split()]

    def end(self):
        if self.writers.poll() is None:
            self.writers.kill()
            self.writers.wait()
        self.down()


def at_once_since(watcher, since, at_once_s):
    """When the first event came at once that was written after that moment; none: not yet."""
    first = None
    for _, written, came, _ in reversed(watcher.heard):
        if written < since:
            break
        if came - written < at_once_s:
            first = came
    return first


def wait_for(what, condition):
    end = time.time() + PATIENCE_S
    while time.time() < end:
        if condition():
            return
        time.sleep(0.02)
    raise SystemExit(f'{what}: not within {PATIENCE_S} s')


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else float('nan')


def watch_under_kills(kill_count, at_once_s=0.1, seed=20261125):
    """at_once_s: an event that comes within this of being written ends a recovery."""
    chance = random.Random(seed)
    plant = Listened()
    watchers = []
    try:
        plant.begin()
        watchers = [Watcher(plant, plant.words), Watcher(plant, plant.words)]
        blows = [watchers[0].kill, plant.kill_plant, watchers[0].kill, plant.kill_plant, plant.kill_database]
        recoveries = []
        for i in range(kill_count):
            wait_for('an event that comes at once', lambda: all(at_once_since(each, time.time() - 5, at_once_s) for each in watchers))
            time.sleep(chance.uniform(0.3, 1.5))
            began = time.time()
            blows[i % len(blows)]()
            back = time.time()
            wait_for('recovery', lambda: all(at_once_since(each, back, at_once_s) for each in watchers))
            recoveries.append((began, max(at_once_since(each, back, at_once_s) for each in watchers)))
        time.sleep(1)
        told, _ = plant.writers.communicate('')
        committed = json.loads(told.splitlines()[-1])  # when whoever wrote it was told that it stays
        journal = plant.journal()
        wait_for('the last event', lambda: all(each.heard and each.heard[-1][0] >= journal[-1] for each in watchers))
    finally:
        for each in watchers:
            each.stop()
        plant.end()

    def is_outside(written_at, came):
        return not any(came >= began and written_at <= ended for began, ended in recoveries)

    figures = {'kills': kill_count, 'written': len(committed), 'lost': 0, 'repeated': 0, 'out_of_order': 0}
    # Of the journal's beginning the first is history, not news.
    first_kill = recoveries[0][0]
    lags_ms, since_written_ms = [], []
    for each in watchers:
        sequences = [one[0] for one in each.heard]
        if set(sequences) - set(journal):
            raise SystemExit('events were told that the journal does not have')
        figures['lost'] += len(set(journal) - set(sequences))
        figures['repeated'] += len(sequences) - len(set(sequences))
        figures['out_of_order'] += sum(a > b for a, b in zip(sequences, sequences[1:]))
        for _, written_at, came, blade in each.heard:
            if came > first_kill - 0.3 and is_outside(written_at, came):
                since_written_ms.append(1e3 * (came - written_at))
                lags_ms.append(max(0.0, 1e3 * (came - committed.get(blade[len('blades/'):], written_at))))
    figures['recovery_p95_s'] = percentile([ended - began for began, ended in recoveries], 0.95)
    figures['lag_p50_ms'] = percentile(lags_ms, 0.5)
    figures['lag_p99_ms'] = percentile(lags_ms, 0.99)
    figures['lag_count'] = len(lags_ms)
    figures['since_written_p99_ms'] = percentile(since_written_ms, 0.99)
    return figures
