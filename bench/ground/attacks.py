"""What a stranger does to a plant, each a test of the house with its figure; run here so that the figures stand beside each other."""
import os
import subprocess
import tempfile
import xml.etree.ElementTree as Xml

# Program, test, in words, and the figure that it tells (None: refused or not).
ATTACKS = [
    ('services_runtime_tests', 'ServerTest.ACompressedMessageIsRefusedBeforeItIsInflated', '100 MB in 100 KB, deflated and gzipped',
     'bomb_rss_mb'),
    ('services_runtime_tests', 'ServerTest.StreamsThatAreResetAtOnceTakeLittleMemory', 'calls begun and reset at once, four connections',
     'rapid_reset_rss_mb'),
    ('services_runtime_tests', 'ServerTest.OfAStrangersRequestsNextToNothingIsHeld', '90 requests of 8 MB by who has no certificate',
     'strangers_rss_mb'),
    ('services_runtime_tests', 'ServerTest.CallsWhoseRequestDoesNotComeAreEnded', 'calls that are begun and never made', None),
    ('services_runtime_tests', 'ServerTest.OnePeersConnectionsNeitherStopOthersNorGrowMemory', '3000 idle connections of one peer',
     'idle_connections_rss_mb'),
    ('services_runtime_tests', 'ServerTest.ExhaustedDescriptorsRecover', 'no descriptor left', None),
    ('services_runtime_tests', 'ServerTest.TooLargeAMessageOrHeaderIsRefused', 'a message or a header too large', None),
    ('services_ingest_tests', 'HostileClientsTest.OneByteASecondLosesItsSlotAndHarmsNobody', 'uploads of a byte a second', None),
    ('services_ingest_tests', 'HostileClientsTest.StreamsWithoutAHeaderTakeNoSlot', 'uploads that never say their header', None),
    ('services_ingest_tests', 'HostileClientsTest.AMessageThatSaysItIsHugeIsRefusedAtOnce', 'a message that says it is huge', None),
    ('services_ingest_tests', 'HostileClientsTest.WhoNeverReadsHoldsNoConnectionAndIsLetGo', 'downloads that nobody reads', None),
    ('services_ingest_tests', 'ScanServiceTest.RefusesMoreUploadsOfOnePeerThanItsShare', 'all upload slots for one peer', None),
    ('services_ingest_tests', 'ScanServiceTest.KeepsWhatWasSentBesideWhatReadersDecode', "a stranger's encoding read by others", None),
    ('services_ingest_tests', 'DecodeWorkers.SurviveMutatedBlocks', 'Draco bombs and mutants', None),
    ('sandbox_tests', 'HostileWorker.IsRefusedEveryAct', 'a worker taken over: 26 acts', None),
    ('storage_tests', 'Stores/BlobKeepingTest.ABucketThatIsAnothersLosesNothingAndGetsNothing/1', 'two plants on one bucket',
     'foreign_deleted'),
    ('end_to_end_tests', 'Door.EveryCertificateThatDoesNotCountIsRefusedAndKept', 'no certificate, or one that does not count', None),
    ('end_to_end_tests', 'Door.EveryMethodLetsInWhomItsRuleNamesAndNobodyElse', 'every method by every role that may not call it', None),
    ('end_to_end_tests', 'Door.ARevocationCountsForTheNextCallAndEndsOpenStreams', 'a certificate taken back, on connections of before', None),
    ('storage_tests', 'RightsTest.*', 'a service that wants to change the record', None),
]


def run(bin_folder, shared_folder):
    """Yields (words, 'held', 'not held' or 'not tried', figure's key, its value)."""
    environment = dict(os.environ, SIXPOINT_SOURCE_DIR=os.getcwd(), SIXPOINT_BIN_DIR=bin_folder, SIXPOINT_SHARED_DIR=shared_folder)
    for program, test, words, key in ATTACKS:
        with tempfile.NamedTemporaryFile(suffix='.xml') as report:
            subprocess.run([f'{bin_folder}/{program}', f'--gtest_filter={test}', f'--gtest_output=xml:{report.name}'],
                           env=environment, capture_output=True, timeout=600)
            try:
                cases = [case for case in Xml.parse(report.name).iter('testcase') if case.get('status') == 'run']
            except Xml.ParseError:  # it died
                cases = []
        failed = not cases or any(case.find('failure') is not None for case in cases)
        skipped = any(case.get('result') == 'skipped' or case.find('skipped') is not None for case in cases)
        found = [prop.get('value') for case in cases for prop in case.iter('property') if prop.get('name') == key]
        yield words, 'not held' if failed else 'not tried' if skipped else 'held', key, float(found[0]) if found else None
