import click
@click.command()
def info(): pass
