# The cells of a study as jobs of Snakemake, here or on whatever cluster it knows; what is done is not done again.
#   snakemake --snakefile deploy/examples/study.smk --cores 4 --config file=study.yaml folder=study
import json

FOLDER = config["folder"]


def cells(wildcards):
    with open(checkpoints.plan.get().output[0]) as plan:
        return [f"{FOLDER}/cells/{cell['cell']:04}/summary.json" for cell in json.load(plan)["cells"]]


rule table:
    input: cells
    output: f"{FOLDER}/table.csv"
    shell: "consort collect {FOLDER}"


checkpoint plan:
    input: config["file"]
    output: f"{FOLDER}/plan.json"
    shell: "consort run {input} --output {FOLDER} --plan --quiet"


rule cell:
    input: f"{FOLDER}/plan.json"
    output: f"{FOLDER}/cells/{{cell}}/summary.json"
    params: number=lambda wildcards: int(wildcards.cell)
    shell: "consort run --resume {FOLDER} --cell {params.number} --quiet"
